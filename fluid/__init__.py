"""The water: stabilised finite elements on a fixed tetrahedral mesh that solids cut freely."""

"""Dry scenes: joints and contacts of rigid blocks with extreme parameters."""

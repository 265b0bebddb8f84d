"""Stills and films of a run, written beside it under `pictures/`."""

import os

import imageio_ffmpeg
from PIL import Image

from coupler.commands.view.scene import Scene

HOLD = 1.0  # [s] for which a film shows its last frame
FINER = 2  # a still has so many times the pixels of a film each way: it is for print
AVERAGED = (
    1.5  # pixels drawn each way for one of a film, which shows their mean; half the cost of smoothing by VTK
)


def stills(run, folder, size, times, **camera):
    """Write a picture of the stored step nearest to each time [s], None the last step; return their paths."""
    scene = Scene(run, tuple(FINER * pixels for pixels in size), **camera)
    written = []
    for time in times:
        written.append(folder / f"still_{scene.draw(time):.3f}s.png")
        Image.fromarray(scene.picture()).save(written[-1], dpi=(300, 300), optimize=True)
    scene.close()
    return written


def film(run, folder, size, fps=20, tell=None, **camera):
    """Write every stored step as one frame of an H.264 film; tell(frames done, frames) is called after each.

    Written under another name first, so that a film that is there is a whole film.
    """
    path, unfinished = folder / "film.mp4", folder / "unfinished.mp4"
    size = tuple(pixels - pixels % 2 for pixels in size)  # H.264 halves the colour planes
    scene = Scene(run, tuple(round(AVERAGED * pixels) for pixels in size), soft=False, **camera)
    scale = f"scale={size[0]}:{size[1]}:flags=area"
    frames = imageio_ffmpeg.write_frames(
        str(unfinished), scene.size, fps=fps, codec="libx264", quality=None, macro_block_size=2,
        ffmpeg_log_level="error",
        output_params=["-vf", scale, "-crf", "19", "-preset", "veryfast", "-movflags", "+faststart"],
    )  # fmt: skip
    frames.send(None)
    for done, time in enumerate(run.times, start=1):
        scene.draw(time)
        picture = scene.picture()
        for _ in range(1 if done < len(run.times) else 1 + round(HOLD * fps)):
            frames.send(picture)
        if tell:
            tell(done, len(run.times))
    frames.close()
    scene.close()
    os.replace(unfinished, path)
    return path

"""`python -m docs.tools.piston_film`: write docs/piston.gif and piston-force.png from the results of `make demo`."""

import subprocess
from pathlib import Path

import imageio_ffmpeg
from PIL import Image

DOCS = Path(__file__).resolve().parents[1]
RESULTS = DOCS.parent / "out" / "piston" / "scene"
FILTERS = "fps=8,scale=440:-1:flags=lanczos,split[a][b];[a]palettegen=max_colors=64[p];[b][p]paletteuse=dither=none"
"""Eight pictures a second of 64 colours: 0.6 MB."""
WIDTH = 640


def main() -> None:
    """Write both pictures."""
    film = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error", "-i", str(RESULTS / "cycle.mp4")]
    subprocess.run([*film, "-vf", FILTERS, str(DOCS / "piston.gif")], check=True)
    picture = Image.open(RESULTS / "force.png").convert("RGB")
    small = picture.resize((WIDTH, picture.height * WIDTH // picture.width), Image.Resampling.LANCZOS)
    small.quantize(64).save(DOCS / "piston-force.png", optimize=True)


if __name__ == "__main__":
    main()

"""A motion space in ten lines: motion_space_in_ten_lines.py CLIPS_FOLDER

An editor that knows cells (%%) runs it step by step.
"""
# %% The functions that describe a folder of clips
import sys

import numpy as np

import kinespace

library = kinespace.MotionSpace.build(sys.argv[1], "ten-lines.kspace")
print(library, "vectors", library.vectors.shape)

# %% The clips that are most like one of them
name = library.clips[0]
for match in library.query(name, k=3):
    print(f"{match.distance:.4f}  {match.clip}")

# %% The clips that differ most
distances = library.distance_matrix()
first, second = np.unravel_index(distances.argmax(), distances.shape)
print("farthest:", library.clips[first], "and", library.clips[second])

# %% One of them from three functions: how far joints are off, in cm
for functions in (3, 10):
    coarse, fine = library.clip(name, functions), library.clip(name)
    error = np.linalg.norm(coarse.positions - fine.positions, axis=2)
    print(f"{functions} functions: mean {error.mean():.2f} cm, largest {error.max():.2f} cm")

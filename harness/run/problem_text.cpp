#include "harness/run/problem_text.h"

#include <fmt/format.h>

#include "harness/io/text.h"

namespace nullmark {

std::string problem_readme(const std::string& name, bool answers) {
  return fmt::format(
      R"(# Problem: {}

Draw samples of these scenes with your renderer, write them to a file, and nullmark judges them: PASS proves that their bias is
small, FAIL proves that they are biased.

| file | what it holds |
|---|---|
| `problem.json` | the scenes, and the configuration that `nullmark judge` reads |
| `volumes/ID.vdb` | OpenVDB, grid `density`: extinction in 1/length at voxel centres |
| `volumes/ID.raw` | the same: 32-bit floats, little-endian, x fastest, then y, then z, no header |
| `rays/ID.npy` | 64-bit floats, shape (rays, 8): origin x y z, unit direction x y z, begin, end |
{}
A scene in `problem.json` has an `id`, and tells:

| key | meaning |
|---|---|
| `quantity` | `transmittance`: exp(-depth); `optical_depth`: the depth, the integral of the extinction |
| `channels`, `spectrum` | extinction of channel c is the field times `spectrum[c]` |
| `bounds` | world box of the medium; the extinction is 0 outside |
| `maximum_extinction`, `minimum_extinction` | true bounds over the box, per channel, 1/length |
| `volume` | `vdb`, `grid`, `raw`, `dims`, `index_to_world`, `extinction_per_value`, `interpolation` |
| `rays` | `file`, `count`, `width`, `height` |

## The medium

Extinction = voxel value x `extinction_per_value` (x spectrum). `index_to_world` has three rows of four numbers: world = M (i, j, k, 1),
where (0, 0, 0) is the first voxel of the raw file. Voxel centres are at integers.

- `trilinear`: between centres the value is interpolated linearly along x, y and z, as OpenVDB's BoxSampler does. The medium reaches to
  the outermost centres of the raw file, which has one voxel around the active box of the .vdb file. The extinction is 0 outside.
- `nearest`: each voxel fills the cube of half a voxel around its centre. The extinction is 0 outside.

A renderer that interpolates otherwise solves another problem, and is told to be biased.

## The rays

The quantity runs over origin + t direction, begin <= t <= end, in world lengths. begin == end means that the ray misses: its
transmittance is 1, its depth 0. Where `width` and `height` are not 0, ray = y * width + x, and y = 0 is the lowest row of the image.

## Samples in a file

Write an `.npy` file of 32- or 64-bit floats, C order, shape (samples, rays), or (samples, rays, channels): one estimate of the
quantity each, of one path. Two numbers in it must not share random numbers. If those of one row do, give `--correlated`: then a row is
judged as an image.

```
nullmark judge . mine.npy --scene 0 --range unit
```

`--range` says what holds of every sample: `unit`: in [0, 1]; `non_negative`; `binary`: 0 or 1; without it they may have any sign. With a range
fewer samples decide. The first samples of each ray, an eighth of them or 128, are used up as a pilot that plans the verdict.

## Samples as images

Or write a folder of OpenEXR images of the size of `rays`, 32-bit floats, each with a seed of its own. Pixels of one image may share
random numbers. An image counts as one sample of the mean of its pixels, and of the mean of each of 16 tiles. In [0, 1] a PASS to 1 %
takes about 800 images, divided by the mean transmittance. Without a range the pilot alone takes more than 100 images.

```
nullmark judge . renders/ --scene 0 --range unit
```

Exit codes: 0 PASS, 3 FAIL, 77 undecided, 2 a file that cannot be used.
)",
      markdown_cell(name), answers ? "| `answers/ID.npy` | 64-bit floats, shape (rays, channels): the exact values |\n" : "");
}

}  // namespace nullmark

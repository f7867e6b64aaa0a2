//! Why [`Mode::Inner`](crate::Mode::Inner) never hides what a GPU would show.
//!
//! # Coverage
//!
//! Before it rasterizes, a GPU moves each vertex to a subpixel grid, by no more than a step of it along each
//! axis; and its arithmetic and ours round. Let `s` bound, along each axis, how far a vertex as the GPU
//! rasterizes it may be from the same vertex as computed here.
//!
//! *A pixel centre `p` in a polygon `T`, farther than `s` (along some axis) from every point of its border, is
//! covered by every polygon whose vertices are within `s` of those of `T`.* Move the vertices in straight
//! lines from the one polygon to the other. Each point of the border moves along with them by no more than
//! `s` along each axis, so none ever passes `p`, and the winding number of the border about `p` stays 1. The
//! converse holds, too: if `p` is within `s` of a point of the border, moving all of `T` by the difference
//! puts the border on `p`. So this is exactly the set of pixels that *every* displacement covers.
//!
//! For a convex polygon that set is the polygon eroded by a square of half width `s`: each edge with normal
//! `n` moves inward by `s (|n_x| + |n_y|)`. Where an edge meets a row of pixels that is `s (1 + |slope|)` along
//! the row, added once per edge in triangle setup; the walk over tiles is that of `paper`. An edge that is
//! horizontal up to `1/4096` px is left out; rows above and below the eroded vertices are, too, and the
//! remaining edges bound a polygon whose corners are on edges of `T`.
//!
//! The argument asks for no triangle: it covers the polygon that is left of a triangle after clipping,
//! provided that the GPU's clipped polygon contains it up to `s`. Ours is clipped a millionth behind the near
//! plane, and nearer to the image than any guard band of a GPU.
//!
//! # Depth
//!
//! Nearness `d` is affine in the image ([`Depth`](crate::Depth)). The GPU covers `p` with a triangle whose
//! vertices are `v_i + e_i`, `|e_i| <= s`: with barycentric coordinates `l_i`, `p = sum l_i (v_i + e_i)`, and
//! the depth there is `sum l_i d_i`, which is the depth of our plane at `sum l_i v_i`, a point within `s` of
//! `p`. It is therefore no less than the plane at `p` minus `s (|dx| + |dy|)`, and no less than the least
//! vertex. A GPU that extrapolates the unmoved plane to `p` finds no less either: `p` is in the unmoved
//! triangle. A subtile's depth is the least of this over its 32 pixel centres.
//!
//! # Rounding
//!
//! With `u = 2^-24`, and `R` the largest coordinate plus the longer side of the image, pixels:
//!
//! - *Clip space.* Where occluders come as meshes, the GPU's clip-space components differ from ours by up to
//!   `E` (`geometry::clip_error`); it moves x/w and 1/w by up to `E/w (1 + |x/w|)`, hence
//!   `2 E R max(1/w)` px and as much of the depth, relatively.
//! - *Projection and viewport.* A division, two products and a sum: `4 u R`, and once more for the GPU.
//!   Together: `s = step + R (8 u + 2 E max(1/w))`.
//! - *Events.* `slope (row - y) + x` with a slope from two differences and a division, where the result is in
//!   the image: `8 u R`, added to the shift of each edge. Out of the image it only matters that it is.
//! - *The plane's gradients.* From differences of rounded coordinates, over the area. With `B` the area of the
//!   bounding box over twice the triangle's and `Z` the range of its depths, the products err by `3 u` of
//!   themselves and the area by `3 u` of up to `2 B` times itself; over the bounding box this makes
//!   `4 u (1 + 2.2 B) 4 B Z < 64 u B^2 Z` (`B >= 1`). From `B = 4096` on the triangle is flat at its least
//!   depth. Clipped polygons are set up in f64, whose error is nothing against the next.
//! - *Evaluation.* `8 u (max d + (|dx| + |dy|) (R + 64))`.
//! - *The depth itself.* The GPU stores `(z + e_z) / (w + e_w)` with `z = a w + b`. As nearness, `(depth - a) / b`, that is
//!   `1 / (w + e_w)`, which the factor above covers, and `(e_z - a e_w) / (b w)`. With reversed depth in perspective
//!   `|a / b|` is no more than 1 over the far plane's distance, and neither is 1/w less: `E/w` of the nearness holds
//!   what goes by `a`, and what goes by b is `9 u` of the nearness; the divisions of both sides, viewport transform
//!   and format make `10 u`. Hence `24 u` of it. A GPU's weights of three corners err by `4 u` of the largest.
//!   With standard depth, where a is about 1, all that is absolute in depth. The GPU's own errors of z and w are
//!   `E_z / 2` each, where `E_z` is E of these two alone: `E_z/w + 16 u`, over `|b|`
//!   ([`depth_tolerance`](crate::Mode::Inner)).
//!
//! # Queries
//!
//! Bounds grow by the same `s` in the image, and their nearness by the same factor and tolerance. All pixels
//! that they touch are asked for, and one whose depth is not beyond doubt nearer makes the answer *visible*.
//! Bounds that touch the near plane are visible.
//!
//! # What it costs
//!
//! Speed hardly (setup is a little longer). But between two triangles that share an edge the pixels within `s` of it
//! are covered by neither, so a tile there keeps its reference layer until something else covers it: `inner`
//! culls less, most of all behind finely tessellated occluders. Few large triangles make good occluders.

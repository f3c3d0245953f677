//! Frames, segments, convex polygons, shadow triangles and interval sets for line-sampled direct illumination.

//! Ray and line visibility: BVH, shadow-triangle and shaft queries that return the visible intervals of light segments.

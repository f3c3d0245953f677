//! Edges of projected triangles and silhouettes, each stored once for all triangles that share it,
//! with the number of triangles by which its two sides differ.

use super::index::Index;
use crate::clip::Edge;
use crate::orient::Point;

/// An edge of projected triangles or of surfaces, stored once for all that share it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shared {
    pub(super) edge: Edge,
    /// The number of triangles, or layers of surfaces, on the left of the edge, minus the number on
    /// its right.
    pub(super) weight: i32,
    /// The next edge around a projected triangle, if both edges are stored in that triangle's
    /// direction.
    pub(super) next: Option<Index>,
    /// The index of the side that represents the edge in the search for the boundary; `None` if the
    /// edge does not take part.
    pub(super) side: Option<Index>,
}

/// A list of edges with a hash table by their ends.
#[derive(Debug, Default)]
pub(super) struct Edges {
    pub(super) all: Vec<Shared>,
    /// The hash table: indices into the list of edges, by a hash of the ends.
    table: Vec<Option<Index>>,
}

impl Edges {
    pub(super) fn clear(&mut self) {
        self.all.clear();
        self.table.clear();
    }

    /// Ensures capacity for more edges.
    pub(super) fn make_room(&mut self, more: usize) {
        let all = self.all.len() + more;
        if 3 * self.table.len() >= 4 * all {
            return;
        }
        let room = (2 * all).next_power_of_two();
        self.table.clear();
        self.table.resize(room, None);
        // Enter all edges anew in the larger table.
        for (place, Shared { edge, .. }) in self.all.iter().enumerate() {
            let mut slot = spread(hash(edge.from).wrapping_add(hash(edge.to))) & (room - 1);
            while self.table[slot].is_some() {
                slot = (slot + 1) & (room - 1);
            }
            self.table[slot] = Some(Index::new(place));
        }
    }

    /// Adds `more` triangles on the left of an edge; the capacity has to be ensured before. `hash`
    /// is the sum of the hashes of the edge's ends. Returns the edge's index if it is stored in
    /// this direction, and `None` if it is stored in the opposite direction.
    #[allow(clippy::float_cmp, reason = "the very same corners")]
    pub(super) fn count(&mut self, from: Point, to: Point, hash: u64, more: i32) -> Option<usize> {
        // Find the edge in either direction, and count there.
        let mask = self.table.len() - 1;
        let mut slot = spread(hash) & mask;
        while let Some(place) = self.table[slot].map(Index::get) {
            let Shared { edge, weight, .. } = &mut self.all[place];
            if edge.from == from && edge.to == to {
                *weight += more;
                return Some(place);
            }
            if edge.from == to && edge.to == from {
                *weight -= more;
                return None;
            }
            slot = (slot + 1) & mask;
        }
        // Otherwise store it as a new one.
        self.all.push(Shared {
            edge: Edge::new(from, to),
            weight: more,
            next: None,
            side: None,
        });
        let place = self.all.len() - 1;
        self.table[slot] = Some(Index::new(place));
        Some(place)
    }
}

/// Returns the hash of a corner; the sum over both ends is the same for the reversed edge.
pub(super) fn hash(p: Point) -> u64 {
    let bits = p[0].to_bits() ^ p[1].to_bits().rotate_left(23);
    bits.wrapping_mul(0x9E37_79B9_7F4A_7C15)
}

/// Mixes the sum of two hashes to a position in a table.
pub(super) fn spread(sum: u64) -> usize {
    #[allow(clippy::cast_possible_truncation, reason = "the high bits of a hash")]
    {
        (sum.wrapping_mul(0xD6E8_FEB8_6659_FD93) >> 32) as usize
    }
}

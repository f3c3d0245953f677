//! Edges, each once for all that share it.

use super::index::Index;
use crate::clip::Edge;
use crate::orient::Point;

/// An edge of images or of surfaces, once for all that share it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shared {
    pub(super) edge: Edge,
    /// Images, or layers of surfaces, on its left less those on its right.
    pub(super) weight: i32,
    /// The edge after it around an image, if both run that way.
    pub(super) next: Option<Index>,
    /// The side that it is, if it takes part.
    pub(super) side: Option<Index>,
}

/// Edges by their ends.
#[derive(Debug, Default)]
pub(super) struct Edges {
    pub(super) all: Vec<Shared>,
    /// Indices into that, by a hash of the ends.
    table: Vec<Option<Index>>,
}

impl Edges {
    pub(super) fn clear(&mut self) {
        self.all.clear();
        self.table.clear();
    }

    /// Makes room for more.
    pub(super) fn make_room(&mut self, more: usize) {
        let all = self.all.len() + more;
        if 3 * self.table.len() >= 4 * all {
            return;
        }
        let room = (2 * all).next_power_of_two();
        self.table.clear();
        self.table.resize(room, None);
        for (place, Shared { edge, .. }) in self.all.iter().enumerate() {
            let mut slot = spread(hash(edge.from).wrapping_add(hash(edge.to))) & (room - 1);
            while self.table[slot].is_some() {
                slot = (slot + 1) & (room - 1);
            }
            self.table[slot] = Some(Index::new(place));
        }
    }

    /// Counts `more` on the left of an edge, for which there is room, given the sum of the hashes
    /// of its ends; where it is, if it is kept the same way.
    #[allow(clippy::float_cmp, reason = "the very same corners")]
    pub(super) fn count(&mut self, from: Point, to: Point, hash: u64, more: i32) -> Option<usize> {
        // Find the edge, in either direction, and count there.
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
        // Or keep it as a new one.
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

/// Returns the hash of a corner; its sum over both ends is the same for an edge reversed.
pub(super) fn hash(p: Point) -> u64 {
    let bits = p[0].to_bits() ^ p[1].to_bits().rotate_left(23);
    bits.wrapping_mul(0x9E37_79B9_7F4A_7C15)
}

pub(super) fn spread(sum: u64) -> usize {
    #[allow(clippy::cast_possible_truncation, reason = "the high bits of a hash")]
    {
        (sum.wrapping_mul(0xD6E8_FEB8_6659_FD93) >> 32) as usize
    }
}

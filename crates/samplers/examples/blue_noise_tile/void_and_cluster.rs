//! This module makes void-and-cluster dither arrays (R. Ulichney 1993, *The void-and-cluster method
//! for dither array generation*), in integer arithmetic so that every machine makes the same tile.

use linelit_samplers::hash::mix;

/// exp(−1/(2σ²)) for Ulichney's σ = 1.5 pixels: the Gaussian's value at distance one.
const GAUSSIAN_AT_ONE: f64 = 0.800_737_402_916_808_1;

/// A binary pattern on a torus with, for each pixel, the sum of Gaussians around the pixels that
/// are set.
struct Pattern {
    size: usize,
    weights: Vec<u64>,
    set: Vec<bool>,
    energy: Vec<u64>,
    tie_break: Vec<u64>,
}

impl Pattern {
    fn new(size: usize, seed: u64) -> Self {
        let n = size * size;
        let toroidal = |d: usize| d.min(size - d);
        let weights = (0..n)
            .map(|i| {
                let squared = toroidal(i % size).pow(2) + toroidal(i / size).pow(2);
                // Repeated products round alike everywhere, unlike a library's exp.
                let gaussian = (0..squared).fold(1.0, |value, _| value * GAUSSIAN_AT_ONE);
                (gaussian * (1_u64 << 40) as f64) as u64
            })
            .collect();
        let tie_break = (0..n as u64).map(|i| mix(mix(seed + 1) ^ i)).collect();
        Self {
            size,
            weights,
            set: vec![false; n],
            energy: vec![0; n],
            tie_break,
        }
    }

    fn toggle(&mut self, pixel: usize) {
        let size = self.size;
        self.set[pixel] = !self.set[pixel];
        for i in 0..self.set.len() {
            let dx = (i % size + size - pixel % size) % size;
            let dy = (i / size + size - pixel / size) % size;
            let weight = self.weights[dy * size + dx];
            if self.set[pixel] {
                self.energy[i] += weight;
            } else {
                self.energy[i] -= weight;
            }
        }
    }

    fn tightest_cluster(&self) -> usize {
        let set = (0..self.set.len()).filter(|&i| self.set[i]);
        set.max_by_key(|&i| (self.energy[i], self.tie_break[i]))
            .expect("some pixel is set")
    }

    fn largest_void(&self) -> usize {
        let unset = (0..self.set.len()).filter(|&i| !self.set[i]);
        unset
            .min_by_key(|&i| (self.energy[i], self.tie_break[i]))
            .expect("some pixel is not set")
    }
}

/// The ranks 0..size² of a blue-noise tile, row by row.
pub(crate) fn void_and_cluster(size: usize, seed: u64) -> Vec<u16> {
    let n = size * size;
    let mut pattern = Pattern::new(size, seed);
    // A tenth of the pixels at random, then moved from clusters into voids until nothing moves.
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|&i| pattern.tie_break[i]);
    for &pixel in &order[..n / 10] {
        pattern.toggle(pixel);
    }
    loop {
        let cluster = pattern.tightest_cluster();
        pattern.toggle(cluster);
        let void = pattern.largest_void();
        pattern.toggle(void);
        if void == cluster {
            break;
        }
    }
    let initial = pattern.set.clone();
    let mut ranks = vec![0_u16; n];
    for rank in (0..n / 10).rev() {
        let cluster = pattern.tightest_cluster();
        pattern.toggle(cluster);
        ranks[cluster] = rank as u16;
    }
    for pixel in (0..n).filter(|&i| initial[i]) {
        pattern.toggle(pixel);
    }
    // With a linear filter the largest void of the ones is the tightest cluster of the zeros:
    // Ulichney's phases II and III are one loop.
    for rank in n / 10..n {
        let void = pattern.largest_void();
        pattern.toggle(void);
        ranks[void] = rank as u16;
    }
    ranks
}

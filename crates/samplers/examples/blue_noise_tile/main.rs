//! Makes the 64×64 blue-noise tile of the `bluenoise` sampler and writes it, 8192 bytes, to the
//! file named:
//!
//! `cargo run -p linelit-samplers --example blue_noise_tile --
//! crates/samplers/src/blue_noise_64.bin`
#![allow(clippy::cast_possible_truncation, reason = "sizes are at most 64×64")]

mod void_and_cluster;

fn main() -> std::io::Result<()> {
    let Some(path) = std::env::args().nth(1) else {
        return Err(std::io::Error::other("which file shall the tile go to?"));
    };
    let tile = void_and_cluster::void_and_cluster(64, 0);
    let bytes: Vec<u8> = tile.iter().flat_map(|rank| rank.to_le_bytes()).collect();
    std::fs::write(path, bytes)
}

#[test]
fn the_generator_reproduces_the_committed_tile() {
    let tile = void_and_cluster::void_and_cluster(64, 0);
    for (i, &rank) in tile.iter().enumerate() {
        let committed = linelit_samplers::blue_noise_rank([i as u32 % 64, i as u32 / 64]);
        assert_eq!(rank, committed, "entry {i}");
    }
}

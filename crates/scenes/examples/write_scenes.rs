//! A program that writes the scenes in the repository anew:
//! `cargo run -p linelit-scenes --example write_scenes`.

use std::path::Path;

fn main() -> std::io::Result<()> {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    for (name, bytes) in linelit_scenes::kept() {
        std::fs::write(dir.join(name), bytes)?;
    }
    Ok(())
}

//! A program that prints the contents of an EXR or PFM file, and writes its main picture as PNG:
//! `cargo run -p linelit-film --example look -- picture.exr [picture.png]`.

#![allow(clippy::print_stdout, reason = "an example that prints")]

use std::path::Path;

use linelit_film::{Document, Exposure, FilmError, Image, write_png};

fn main() -> Result<(), FilmError> {
    let mut arguments = std::env::args().skip(1);
    let Some(input) = arguments.next() else {
        println!("usage: look PICTURE.exr|.pfm [PICTURE.png]");
        return Ok(());
    };
    // Print size and mean of the main picture.
    let image = Image::read(Path::new(&input))?;
    println!(
        "{} × {}, mean {:?}",
        image.width,
        image.height,
        image.mean()
    );
    // Print the layers and the metadata of an EXR file.
    if let Ok(document) = Document::read(Path::new(&input)) {
        for layer in &document.layers {
            let channels: Vec<&str> = layer.channels.iter().map(|c| c.name.as_str()).collect();
            println!("layer `{}`: {}", layer.name, channels.join(", "));
        }
        for (name, value) in &document.metadata {
            println!("{name} = {value}");
        }
    }
    // Write the picture as PNG.
    if let Some(output) = arguments.next() {
        write_png(Path::new(&output), &image, Exposure::fitting(&image, 0.98))?;
    }
    Ok(())
}

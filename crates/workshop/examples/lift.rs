//! How much light passes under occluders if shadow rays start farther off their surface:
//! `cargo run --release -p linelit-workshop --example lift -- SCENE [REFERENCE [SHARE]]`.
//!
//! For each pixel of a diffuse scene, 256 stratified points of each light are asked twice, from the
//! shading point as it is (128 units of `f64` roundoff off its surface) and from SHARE × (1 + the
//! largest coordinate) off it: 8.94e-5 if not told, which is Mitsuba 3's `RayEpsilon`. What the
//! points send is the same in both. REFERENCE is an image to hold both means to.
#![allow(clippy::print_stdout, reason = "a program that prints a table")]

use anyhow::Context;
use linelit_bsdf::Reflection;
use linelit_film::Image;
use linelit_formats::LoadOptions;
use linelit_geometry::{DVec3, Margins};
use linelit_integrator::{Estimator, Renderer, Settings, ShadingPoint, Workspace};
use linelit_lights::{AreaLight, AreaSampler, Light, PointTechnique};
use linelit_samplers::{Sampler, SamplerKind};
use linelit_visibility::{Ray, Scratch};
use std::path::Path;

/// Points of each light.
const POINTS: u32 = 256;

fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let path = args.first().context("SCENE is needed")?;
    let share: f64 = args
        .get(2)
        .map_or(Ok(1500.0 * 0.5f64.powi(24)), |s| s.parse())?;
    let scene = linelit_formats::load(Path::new(path), &LoadOptions::default())?.scene;
    let renderer = Renderer::new(&scene);
    let [width, height] = scene.camera.resolution();
    let mut workspace = Workspace::new();
    let (mut near, mut far, mut exact, mut changed) = (0.0, 0.0, 0.0, 0);
    let settings = Settings {
        estimator: "exact".parse::<Estimator>()?,
        samples: 64,
        ..Settings::default()
    };
    for y in 0..height {
        for x in 0..width {
            let Some(point) = renderer.shading_point([x, y], &mut workspace) else {
                continue;
            };
            exact += mean(renderer.direct(&settings, &point, [x, y], 0, &mut workspace));
            let [a, b] = pixel(&renderer, &point, [x, y], share);
            near += a;
            far += b;
            changed += u32::from((a - b).abs() > 1e-9 * a);
        }
    }
    let pixels = f64::from(width) * f64::from(height);
    println!("mean in closed form {:.7}", exact / pixels);
    println!(
        "points {:.7}; lifted by {share:.3e}: {:+.3e} relative, in {:.2} % of the pixels",
        near / pixels,
        far / near - 1.0,
        100.0 * f64::from(changed) / pixels
    );
    if let Some(reference) = args.get(1) {
        let image = Image::read(Path::new(reference))?;
        let theirs: f64 = image.mean().iter().sum::<f64>() / 3.0;
        println!(
            "reference {theirs:.7}; closed form {:+.3e} of it, lifted {:+.3e}",
            exact / pixels / theirs - 1.0,
            exact / pixels * (far / near) / theirs - 1.0
        );
    }
    Ok(())
}

fn mean(colour: DVec3) -> f64 {
    colour.element_sum() / 3.0
}

/// What a pixel sees of all lights, from the shading point and from farther off its surface.
fn pixel(renderer: &Renderer<'_>, point: &ShadingPoint, pixel: [u32; 2], share: f64) -> [f64; 2] {
    let mut scratch = Scratch::new();
    let mut sums = [0.0; 2];
    for light in renderer.plan().lights() {
        let Light::Area(area) = &*light.light else {
            continue;
        };
        let sampler = AreaSampler::new(&area.polygon);
        let set = Sampler::new(SamplerKind::Stratified, 1).points(pixel, 0, POINTS);
        for i in 0..POINTS {
            let on_light = sampler.sample(set.get_2d(i)).point;
            let value = mean(unshadowed(area, point, on_light)) * area.polygon.area();
            if value == 0.0 {
                continue;
            }
            let surface = point.position - point.geometric_normal * point.lift;
            let lift = share * (1.0 + surface.abs().max_element());
            let origins = [point.position, surface + point.geometric_normal * lift];
            for (sum, origin) in sums.iter_mut().zip(origins) {
                let ray = Ray {
                    origin,
                    direction: on_light - origin,
                    t_min: 0.0,
                    t_max: Margins::DEFAULT.end(),
                };
                if !renderer
                    .occluders()
                    .any_hit(&ray, &light.triangles, &mut scratch)
                {
                    *sum += value / f64::from(POINTS);
                }
            }
        }
    }
    sums
}

/// L f_r cos θ cos θ'/r² of a point of the light.
fn unshadowed(area: &AreaLight, point: &ShadingPoint, on_light: DVec3) -> DVec3 {
    let to_light = on_light - point.position;
    let square = to_light.length_squared();
    let w = to_light / square.sqrt();
    let side = -area.polygon.normal().dot(w);
    let reflected = point.bsdf.eval(w, point.outgoing, point.normal) * point.cosine(w);
    area.emission.towards(side) * reflected * (side.abs() / square)
}

//! `Camera`, `Film` and `PixelFilter`, which together make the camera and the film of the scene.
//!
//! Films of pbrt can process the picture. Scale factors are applied, and there are warnings about
//! everything else: clamping, for example, would hide the error of estimates that are compared.

use super::Loader;
use super::lexer::{Lexer, Token};
use super::params::{Params, Type};
use linelit_assembly::{ErrorKind, Result, Source, Span, Warnings, shorten};
use linelit_geometry::glam::DAffine3;
use linelit_scene::{Camera, FilmSettings, Projection};
use std::sync::Arc;

/// The largest number of pixels along a side of the film; larger films are refused.
const MAX_SIDE: i32 = 1 << 16;
/// The largest number of pixels of the film in all; larger films are refused.
const MAX_PIXELS: i64 = 1 << 28;

/// The camera, film and filter as far as the file has described them.
#[derive(Debug, Default)]
pub(super) struct View {
    camera: Option<CameraSettings>,
    film: Option<FilmSettings>,
    filter: Option<PixelFilter>,
    /// Whether the film is one that only pbrt-v4 knows.
    pub(super) is_v4: bool,
}

/// Half the width of a reconstruction filter, in pixels.
#[derive(Debug)]
struct PixelFilter {
    /// The radii in the file, across and down.
    radius: [Option<f64>; 2],
    /// The default radii, in pbrt-v3 and in pbrt-v4.
    usual: [f64; 2],
}

/// A camera before the resolution of its film is known.
#[derive(Debug)]
struct CameraSettings {
    world_to_camera: DAffine3,
    projection: Projection,
    screen_window: Option<[f64; 4]>,
    frame_aspect_ratio: Option<f64>,
    /// The time for which the shutter is open, `shutterclose` − `shutteropen`.
    shutter: f64,
    /// The position of the directive in the file.
    place: Option<(Arc<Source>, Span)>,
}

impl View {
    /// Makes the camera and the film after all directives, with defaults for those that are
    /// missing. A missing camera is a warning.
    pub(super) fn finish(
        self,
        warnings: &mut Warnings,
        source: &Source,
    ) -> Result<(Camera, FilmSettings)> {
        // Set the radius of the filter, whose default depends on the version.
        let has_film = self.film.is_some();
        let mut film = self.film.unwrap_or_default();
        if let Some(PixelFilter { radius, usual }) = self.filter {
            let usual = usual[usize::from(self.is_v4)];
            film.filter_radius = radius.map(|radius| radius.unwrap_or(usual));
        }
        // Take the camera, or the default one.
        let settings = match self.camera {
            Some(settings) => settings,
            None => {
                let message =
                    "the scene has no camera: looking along +z from the origin, 90 degrees";
                warnings.warn(ErrorKind::Suspicious, message, |e| e.in_file(source.name()))?;
                CameraSettings {
                    world_to_camera: DAffine3::IDENTITY,
                    projection: Projection::Perspective { fov_degrees: 90.0 },
                    screen_window: None,
                    frame_aspect_ratio: None,
                    shutter: 1.0,
                    place: None,
                }
            }
        };
        // Scale by the exposure, and place the camera.
        let is_v4 = has_film.then_some(self.is_v4);
        film.scale *= settings.exposure(is_v4, warnings)?;
        let camera = Camera::from_world_to_camera(
            settings.world_to_camera,
            settings.projection,
            settings.screen_window,
            settings.frame_aspect_ratio,
            [film.width, film.height],
        );
        Ok((camera, film))
    }
}

impl CameraSettings {
    /// Returns the factor of the picture by the time for which the shutter is open: the time itself
    /// in version 4, and one in version 3. The film decides the version; without a film there is a
    /// warning if the time is not one.
    fn exposure(&self, is_v4: Option<bool>, warnings: &mut Warnings) -> Result<f64> {
        let usual = (self.shutter - 1.0).abs() <= 0.0;
        let Some((source, span)) = self.place.as_ref().filter(|_| !usual) else {
            return Ok(1.0);
        };
        let at = source.at(*span);
        match is_v4 {
            Some(true) if self.shutter > 0.0 => return Ok(self.shutter),
            Some(true) => {
                let message = "the shutter does not open: the picture would be black";
                let label = "expected `shutteropen` before `shutterclose`";
                return Err(at.error(ErrorKind::OutOfRange, message, label));
            }
            Some(false) => {}
            None => {
                let message = "the time that the shutter is open scales pbrt-v4's pictures, not \
                               pbrt-v3's";
                let label = "without a `Film` taken for version 3";
                warnings.warn(ErrorKind::Suspicious, message, |e| e.at(at, label))?;
            }
        }
        Ok(1.0)
    }
}

impl Loader {
    /// Executes `Camera "perspective" …`: the current transform is from world to camera.
    pub(super) fn camera(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        // Check the transform, and make it the coordinate system `camera`.
        let (name, params) = self.named_params(lexer, token, "camera")?;
        self.before_world(&params, "Camera")?;
        let determinant = self.state.ctm.matrix3.determinant();
        let camera_to_world = self.state.ctm.inverse();
        if determinant == 0.0 || !camera_to_world.is_finite() {
            let message = "the camera's transform cannot be inverted";
            return Err(params.error(ErrorKind::BadTransform, message, ""));
        }
        self.coordinate_systems
            .insert("camera".into(), camera_to_world);
        // Read the parameters.
        let shutter =
            params.float_or("shutterclose", 1.0)? - params.float_or("shutteropen", 0.0)?;
        let screen_window = params.fixed::<4>("screenwindow", &[Type::Float])?;
        if let Some([x0, x1, y0, y1]) = screen_window
            && (x0 >= x1 || y0 >= y1)
        {
            let message = "the screen window is empty";
            let label = "expected x_min < x_max, y_min < y_max";
            return Err(params.error(ErrorKind::OutOfRange, message, label));
        }
        let frame_aspect_ratio = match params.float("frameaspectratio")? {
            Some(_) => Some(params.positive_or("frameaspectratio", 1.0)?),
            None => None,
        };
        let projection = self.projection(&name, &params)?;
        if params.float_or("lensradius", 0.0)? > 0.0 {
            let message = "depth of field is not supported";
            self.base
                .unsupported(message, "everything is in focus", params.at())?;
        }
        params.ignore(&["focaldistance"]);
        self.warn_unused(&params)?;
        self.view.camera = Some(CameraSettings {
            world_to_camera: self.state.ctm,
            projection,
            screen_window,
            frame_aspect_ratio,
            shutter,
            place: Some((Arc::clone(&params.source), params.span)),
        });
        Ok(())
    }

    /// Reads the projection of a camera of this type.
    fn projection(&mut self, name: &str, params: &Params) -> Result<Projection> {
        match name {
            "perspective" => {
                // Read the angle of view, or half of it.
                let half = params.float("halffov")?;
                let fov_degrees = match half {
                    Some(half) => 2.0 * half,
                    None => params.float_or("fov", 90.0)?,
                };
                if fov_degrees > 0.0 && fov_degrees < 180.0 {
                    return Ok(Projection::Perspective { fov_degrees });
                }
                let message = format!("a field of view of {fov_degrees} degrees");
                let label = "expected an angle between 0 and 180 degrees";
                Err(params.range_error(&["fov", "halffov"], message, label))
            }
            "orthographic" => Ok(Projection::Orthographic),
            "environment" => Ok(Projection::Spherical { z_up: false }),
            "spherical" => match params.string("mapping")? {
                Some("equirectangular") => Ok(Projection::Spherical { z_up: true }),
                _ => {
                    let message = "the equal-area mapping of spherical cameras is not supported";
                    let error = params.error(ErrorKind::Unsupported, message, "");
                    Err(error.help("add \"string mapping\" \"equirectangular\""))
                }
            },
            "realistic" => {
                let message = "realistic cameras are not supported";
                let error = params.error(ErrorKind::Unsupported, message, "");
                Err(error.help("use a `perspective` camera"))
            }
            _ => {
                let known = "perspective orthographic environment spherical realistic";
                Err(params.unknown("camera", name, known.split(' ')))
            }
        }
    }

    /// Refuses a directive that has to be before `WorldBegin`.
    fn before_world(&self, params: &Params, word: &str) -> Result<()> {
        if !self.in_world {
            return Ok(());
        }
        let message = format!("`{word}` behind `WorldBegin`");
        Err(params.error(ErrorKind::Nesting, message, "belongs before the world"))
    }

    /// Executes `Film "image" …`, `Film "rgb" …`.
    pub(super) fn film(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let (name, params) = self.named_params(lexer, token, "film")?;
        self.before_world(&params, "Film")?;
        // Read the resolution. The only film of pbrt-v3 is `image`, with another default than v4's.
        let v4 = [1280, 720];
        let films = [
            ("image", [640, 480]),
            ("rgb", v4),
            ("gbuffer", v4),
            ("spectral", v4),
        ];
        let default = params.pick("film", &name, &films)?;
        self.view.is_v4 = default == v4;
        let width = side(&params, "xresolution", default[0])?;
        let height = side(&params, "yresolution", default[1])?;
        if i64::from(width) * i64::from(height) > MAX_PIXELS {
            let message = format!("a film of {width} x {height} pixels");
            return Err(params.error(ErrorKind::Limit, message, "too many pixels"));
        }
        let mut film = FilmSettings::new(width.cast_unsigned(), height.cast_unsigned());
        if self.view.is_v4
            && let Some(bounds) = params.fixed::<4>("pixelbounds", &[Type::Integer])?
        {
            film.crop = pixel_bounds(bounds, [film.width, film.height]);
        }
        // A crop window replaces pixel bounds, as in pbrt-v4.
        if let Some(window) = params.fixed::<4>("cropwindow", &[Type::Float])? {
            film.crop = crop_window(window, [film.width, film.height]);
        }
        let [x0, x1, y0, y1] = film.crop;
        if x0 >= x1 || y0 >= y1 {
            let message = "the crop window is empty";
            return Err(params.error(ErrorKind::OutOfRange, message, "no pixel is left"));
        }
        film.scale = self.film_scale(&name, &params)?;
        self.warn_unused(&params)?;
        self.view.film = Some(film);
        Ok(())
    }

    /// Returns the factor by which a film scales radiance, and warns about other processing of the
    /// picture.
    fn film_scale(&mut self, name: &str, params: &Params) -> Result<f64> {
        // Ignore the size of the sensor, which matters to realistic cameras only.
        params.ignore(&["diagonal", "filename"]);
        if !self.view.is_v4 {
            self.unclamped(params, "maxsampleluminance")?;
            return params.positive_or("scale", 1.0);
        }
        params.ignore(&["savefp16"]);
        self.unclamped(params, "maxcomponentvalue")?;
        if let Some(sensor) = params.string("sensor")?.filter(|name| *name != "cie1931") {
            let message = format!("the sensor `{}` is not supported", shorten(sensor));
            let label = "its colours are those of `cie1931`";
            self.base.unsupported(message, label, params.at())?;
        }
        if params.float_or("whitebalance", 0.0)? != 0.0 {
            let message = "white balance is not supported";
            let label = "colours stay as they are";
            self.base.unsupported(message, label, params.at())?;
        }
        match name {
            "gbuffer" => params.ignore(&["coordinatesystem"]),
            "spectral" => {
                params.ignore(&["nbuckets", "lambdamin", "lambdamax"]);
                let message = "spectral films are not supported";
                self.base
                    .unsupported(message, "read as `rgb`", params.at())?;
            }
            _ => {}
        }
        let exposure = params.positive_or("exposuretime", 1.0)?;
        Ok(exposure * (params.positive_or("iso", 100.0)? / 100.0))
    }

    /// Warns that a film clamps values to the parameter of this name, if it is given: linelit does
    /// not clamp.
    fn unclamped(&mut self, params: &Params, name: &'static str) -> Result<()> {
        if params.float(name)?.is_none() {
            return Ok(());
        }
        let message = format!("`{name}` is not supported");
        let label = "bright values are not clamped";
        self.base.unsupported(message, label, params.at())
    }

    /// Executes `PixelFilter "box" …`.
    pub(super) fn pixel_filter(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let (name, params) = self.named_params(lexer, token, "filter")?;
        self.before_world(&params, "PixelFilter")?;
        let filters = [
            ("box", [0.5, 0.5]),
            ("triangle", [2.0, 2.0]),
            ("gaussian", [2.0, 1.5]),
            ("mitchell", [2.0, 2.0]),
            ("sinc", [4.0, 4.0]),
        ];
        // Ignore the shape of the filter, and read its radius, which v3 calls width.
        let usual = params.pick("filter", &name, &filters)?;
        match name.as_str() {
            "gaussian" => params.ignore(&["alpha", "sigma"]),
            "mitchell" => params.ignore(&["B", "C"]),
            "sinc" => params.ignore(&["tau"]),
            _ => {}
        }
        let mut radius = [None; 2];
        for (slot, names) in radius
            .iter_mut()
            .zip([["xwidth", "xradius"], ["ywidth", "yradius"]])
        {
            for name in names.into_iter().filter(|name| params.has(name)) {
                *slot = Some(params.positive_or(name, 1.0)?);
            }
        }
        // Warn about filters other than boxes.
        if name != "box" {
            let message = format!("the filter `{name}` is not supported");
            let label = "camera samples are spread evenly over its width";
            self.base.unsupported(message, label, params.at())?;
        }
        params.ignore(&["xwidth", "xradius", "ywidth", "yradius"]);
        self.warn_unused(&params)?;
        self.view.filter = Some(PixelFilter { radius, usual });
        Ok(())
    }
}

/// Reads the number of pixels along a side of the film.
fn side(params: &Params, name: &'static str, default: i32) -> Result<i32> {
    let side = params.integer(name)?.unwrap_or(default);
    if (1..=MAX_SIDE).contains(&side) {
        return Ok(side);
    }
    let message = format!("a film with `{name}` {side}");
    let label = format!("expected 1 to {MAX_SIDE} pixels");
    Err(params.range_error(&[name], message, &label))
}

/// Converts pbrt's `cropwindow`, fractions of the film, to pixels; both ends are rounded up.
fn crop_window([x0, x1, y0, y1]: [f64; 4], size: [u32; 2]) -> [u32; 4] {
    let ends = [x0.min(x1), x0.max(x1), y0.min(y1), y0.max(y1)];
    let [width, height] = size.map(f64::from);
    let sides = [width, width, height, height];
    let pixels = [0, 1, 2, 3].map(|k| (ends[k].clamp(0.0, 1.0) * sides[k]).ceil());
    pixel_bounds(pixels, size)
}

/// Clamps bounds `[x0, x1, y0, y1]` to the pixels of the film.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the film before the cast"
)]
fn pixel_bounds([x0, x1, y0, y1]: [f64; 4], [width, height]: [u32; 2]) -> [u32; 4] {
    let pixel = |t: f64, n: u32| t.clamp(0.0, f64::from(n)) as u32;
    [
        pixel(x0, width),
        pixel(x1, width),
        pixel(y0, height),
        pixel(y1, height),
    ]
}

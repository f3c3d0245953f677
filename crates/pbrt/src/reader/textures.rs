//! `Texture`, and the parameters of other directives that may be a texture.

use super::lexer::{Lexer, Token};
use super::params::{Params, Type};
use super::state::Target;
use super::{Loader, is_one_of};
use linelit_assembly::{ErrorKind, Result, nearest, shorten};
use linelit_geometry::{DVec2, DVec3};
use linelit_scene::{ImageTexture, Texture, TextureFilter, UvMapping, Wrap};
use std::sync::Arc;

/// The largest number of nodes of a texture's expression ([`Texture::cost`]); larger textures are
/// refused, so that evaluation is cheap.
const MAX_COST: usize = 256;

/// The textures that pbrt has and linelit does not.
const UNSUPPORTED: &str = "bilerp directionmix dots fbm marble ptex uv windy wrinkled";

/// The textures that linelit has, for suggestions.
const TEXTURES: &str = "checkerboard constant imagemap mix scale";

/// The types of parameters that are a number over a surface.
pub(super) const NUMBER: &[Type] = &[Type::Float, Type::Texture];

/// The types of parameters that are a colour over a surface.
pub(super) const COLOUR: &[Type] = &[
    Type::Rgb,
    Type::Xyz,
    Type::Blackbody,
    Type::Spectrum,
    Type::Float,
    Type::Texture,
];

impl Loader {
    /// Executes `Texture "name" "spectrum" "imagemap" …`.
    pub(super) fn texture(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let (name, _) = self.name(lexer, token, "a texture's name")?;
        let (value_type, _) = self.name(lexer, token, "a texture's type")?;
        let (class, mut params) = self.named_params(lexer, token, "texture")?;
        params.add_defaults(&self.state.defaults(Target::Texture));
        let types = [("float", true), ("spectrum", false), ("color", false)];
        let is_number = params.pick("texture type", &value_type, &types)?;
        let texture = self.build_texture(&class, &params, is_number)?;
        if texture.cost() > MAX_COST {
            let message = format!("texture `{}` is nested too deeply", shorten(&name));
            let label = format!("more than {MAX_COST} nodes");
            return Err(params.error(ErrorKind::Limit, message, &label));
        }
        self.warn_unused(&params)?;
        self.textures.insert((is_number, name), Arc::new(texture));
        Ok(())
    }

    /// Reads the texture of a class, such as `imagemap`: a number (`is_number`) or a colour.
    fn build_texture(&mut self, class: &str, params: &Params, is_number: bool) -> Result<Texture> {
        let one = Texture::number(1.0);
        match class {
            "constant" => self.texture_param(params, "value", one, is_number),
            "scale" => self.product(params, is_number),
            "mix" => {
                let a = self.texture_param(params, "tex1", Texture::number(0.0), is_number)?;
                let b = self.texture_param(params, "tex2", one, is_number)?;
                let amount = self.texture_param(params, "amount", Texture::number(0.5), true)?;
                let [a, b, amount] = [a, b, amount].map(Arc::new);
                Ok(Texture::Mix { a, b, amount })
            }
            "checkerboard" => self.checkerboard(params, is_number),
            "imagemap" => self.image_map(params, is_number),
            // Replace textures that are not supported, and refuse unknown names.
            _ if is_one_of(class, UNSUPPORTED) => {
                let message = format!("texture `{class}` is not supported");
                self.base
                    .unsupported(message, "replaced by 0.5", params.at())?;
                params.ignore_all();
                Ok(Texture::number(0.5))
            }
            _ => {
                let known = TEXTURES.split(' ').chain(UNSUPPORTED.split(' '));
                Err(params.unknown("texture", class, known))
            }
        }
    }

    /// Reads a `scale` texture, the product of v3's `tex1` and `tex2` or v4's `tex` and `scale`.
    fn product(&mut self, params: &Params, is_number: bool) -> Result<Texture> {
        let one = Texture::number(1.0);
        let mut names = params.list.iter().map(|p| p.name.as_str());
        let [a, b] = if names.any(|name| name == "tex" || name == "scale") {
            let a = self.texture_param(params, "tex", one.clone(), is_number)?;
            [a, self.number_or_spectrum(params, "scale", one)?]
        } else {
            let a = self.texture_param(params, "tex1", one.clone(), is_number)?;
            [a, self.texture_param(params, "tex2", one, is_number)?]
        };
        Ok(Texture::Product(Arc::new(a), Arc::new(b)))
    }

    /// Reads a `checkerboard`.
    fn checkerboard(&mut self, params: &Params, is_number: bool) -> Result<Texture> {
        let even = self.texture_param(params, "tex1", Texture::number(1.0), is_number)?;
        let odd = self.texture_param(params, "tex2", Texture::number(0.0), is_number)?;
        if params.integer("dimension")?.unwrap_or(2) != 2 {
            let message = "checkerboards in space are not supported";
            let label = "drawn over u and v";
            self.base.unsupported(message, label, params.at())?;
        }
        // Read whether it is filtered, which v3 can switch off; v4 always averages.
        let modes = [("closedform", true), ("none", false)];
        let filtered = params.choice("aamode", "antialiasing mode", &modes)?;
        Ok(Texture::Checkerboard {
            mapping: self.mapping(params)?,
            filtered: filtered.unwrap_or(true),
            even: Arc::new(even),
            odd: Arc::new(odd),
        })
    }

    /// Reads the mapping of texture coordinates, of which only `uv` is supported.
    fn mapping(&mut self, params: &Params) -> Result<UvMapping> {
        let mapping = UvMapping {
            scale: DVec2::new(
                params.float_or("uscale", 1.0)?,
                params.float_or("vscale", 1.0)?,
            ),
            offset: DVec2::new(
                params.float_or("udelta", 0.0)?,
                params.float_or("vdelta", 0.0)?,
            ),
            rotation: 0.0,
        };
        match params.string("mapping")? {
            None | Some("uv") => {}
            Some(other) => {
                let message = format!("texture mapping `{}` is not supported", shorten(other));
                self.base
                    .unsupported(message, "mapped by u and v", params.at())?;
                params.ignore(&["v1", "v2"]);
            }
        }
        Ok(mapping)
    }

    /// Reads an `imagemap`.
    fn image_map(&mut self, params: &Params, is_number: bool) -> Result<Texture> {
        let param = params.require("filename", params.text("filename")?)?;
        let name = &param.strings()[0];
        let mapping = self.mapping(params)?;
        let filter = self.texture_filter(params)?;
        // Read the continuation beyond the edges; `vwrap` and `mirror` are extensions.
        let wraps = [
            ("repeat", Wrap::Repeat),
            ("black", Wrap::Black),
            ("clamp", Wrap::Clamp),
            ("mirror", Wrap::Mirror),
        ];
        let wrap = |name| params.choice(name, "wrap mode", &wraps);
        let across = wrap("wrap")?.unwrap_or(Wrap::Repeat);
        let wrap = [across, wrap("vwrap")?.unwrap_or(across)];
        // Read the encoding, v3's `gamma` or v4's `encoding`. The default is sRGB.
        let encoding = params.string("encoding")?.unwrap_or("sRGB");
        if !["sRGB", "linear"].contains(&encoding) {
            let message = format!("the encoding `{}` is not supported", shorten(encoding));
            self.base
                .unsupported(message, "read as `sRGB`", params.at())?;
        }
        let srgb = params.bool_or("gamma", true)? && encoding != "linear";
        // Load the image; a missing one is grey, if that is only a warning.
        let scale = params.float_or("scale", 1.0)?;
        let invert = params.bool_or("invert", false)?;
        let at = param.at_value(0);
        let data = if is_number {
            self.base.luminance(name, srgb, at)?
        } else {
            self.base.image(name, srgb, at)?
        };
        let Some(data) = data else {
            return Ok(Texture::number(0.5 * scale));
        };
        Ok(Texture::Image(Arc::new(ImageTexture {
            data,
            mapping,
            wrap,
            filter,
            scale,
            invert,
        })))
    }

    /// Reads the filter of an image: v4's `filter`, or v3's `trilinear`, without which v3 averages
    /// over ellipses that are no longer than `maxanisotropy` times their width.
    pub(super) fn texture_filter(&mut self, params: &Params) -> Result<TextureFilter> {
        // Read the limit of the anisotropy.
        let mut max_anisotropy = params.float_or("maxanisotropy", 8.0)?;
        if max_anisotropy.is_nan() || max_anisotropy < 1.0 {
            let message = format!("a `maxanisotropy` of {max_anisotropy}");
            return Err(params.error(ErrorKind::OutOfRange, message, "must be 1 or more"));
        }
        if max_anisotropy > TextureFilter::MAX_ANISOTROPY {
            max_anisotropy = TextureFilter::MAX_ANISOTROPY;
            let message = format!("`maxanisotropy` above {max_anisotropy} is not supported");
            let label = format!("taken as {max_anisotropy}");
            self.base.unsupported(message, &label, params.at())?;
        }
        // Choose the filter; the default depends on the version.
        let ellipses = TextureFilter::Ewa { max_anisotropy };
        let is_trilinear = params.bool_or("trilinear", false)?;
        let filters = [
            ("point", TextureFilter::Point),
            ("bilinear", TextureFilter::Bilinear),
            ("trilinear", TextureFilter::Trilinear),
            ("ewa", ellipses),
            ("EWA", ellipses),
        ];
        Ok(match params.choice("filter", "texture filter", &filters)? {
            Some(filter) => filter,
            None if is_trilinear => TextureFilter::Trilinear,
            None if self.view.is_v4 => TextureFilter::Bilinear,
            None => ellipses,
        })
    }

    /// Reads a parameter that is a value or the name of a texture: a number (`is_number`) or a
    /// spectrum.
    pub(super) fn texture_param(
        &mut self,
        params: &Params,
        name: &'static str,
        default: Texture,
        is_number: bool,
    ) -> Result<Texture> {
        // Take the texture of a name.
        let types = if is_number { NUMBER } else { COLOUR };
        let Some(param) = params.find(name, types)? else {
            return Ok(default);
        };
        if param.ty == Type::Texture {
            return self.named_texture(params, name, is_number);
        }
        // Take a constant; a colour must not be negative.
        if is_number {
            return params
                .float(name)
                .map(|v| v.map_or(default, Texture::number));
        }
        let value = self.spectrum_value(params, param, false)?;
        if param.ty != Type::Spectrum && value.min_element() < 0.0 {
            let message = format!("negative `{name}` of {}", params.owner);
            let at = param.at();
            return Err(at.error(ErrorKind::OutOfRange, message, "must not be negative"));
        }
        Ok(Texture::Constant(value))
    }

    /// Reads v4's `scale` of a scale texture, which may name a texture of either type; that it may
    /// be a colour is an extension.
    fn number_or_spectrum(
        &mut self,
        params: &Params,
        name: &'static str,
        default: Texture,
    ) -> Result<Texture> {
        let types = [Type::Float, Type::Texture, Type::Rgb];
        let given = params.find(name, &types)?;
        if given.is_some_and(|p| p.ty == Type::Rgb) {
            return self.texture_param(params, name, default, false);
        }
        if let Some(texture) = given.and_then(|p| p.strings().first())
            && self.textures.contains_key(&(false, texture.clone()))
        {
            return self.texture_param(params, name, default, false);
        }
        self.texture_param(params, name, default, true)
    }

    /// Returns the texture that a parameter names, which has to be of the right type.
    fn named_texture(
        &mut self,
        params: &Params,
        name: &'static str,
        is_number: bool,
    ) -> Result<Texture> {
        let Some(param) = params.find(name, &[Type::Texture])? else {
            return Ok(Texture::Constant(DVec3::ONE));
        };
        let [texture] = param.strings() else {
            let message = format!("parameter `{name}` of {} takes one texture", params.owner);
            return Err(param.bad(message, "wrong number of values"));
        };
        if let Some(found) = self.textures.get(&(is_number, texture.clone())) {
            return Ok((**found).clone());
        }
        // Suggest a texture with a similar name, or say that it has the other type.
        let what = if is_number {
            "float texture"
        } else {
            "spectrum texture"
        };
        let names = self
            .textures
            .keys()
            .filter(|k| k.0 == is_number)
            .map(|k| k.1.as_str());
        let mut message = format!("unknown {what} `{}`", shorten(texture));
        if self.textures.contains_key(&(!is_number, texture.clone())) {
            message.push_str(": there is one of that name, but of the other type");
        }
        let at = param.at_value(0);
        let error = at.error(ErrorKind::UnknownName, message, "not defined");
        Err(error.suggest(nearest(texture, names)))
    }
}

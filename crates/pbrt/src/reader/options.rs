//! pbrt's rendering options: samplers, integrators, accelerators and `Option`. How pictures are
//! computed is not the scene's to say here: of these directives only what would make another
//! picture is named, and what is unknown.

use super::lexer::{Lexer, Token};
use super::params::Params;
use super::{Loader, is_one_of};
use linelit_assembly::{ErrorKind, Result, SceneError, nearest, shorten};

/// The types of a directive, and the parameters that they have.
type Known = &'static [(&'static str, &'static str)];

const SAMPLERS: Known = &[
    (
        "halton",
        "pixelsamples samplepixelcenter randomization seed",
    ),
    (
        "sobol zsobol paddedsobol",
        "pixelsamples randomization seed",
    ),
    ("stratified", "xsamples ysamples jitter dimensions seed"),
    ("independent random pmj02bn", "pixelsamples seed"),
    (
        "02sequence lowdiscrepancy maxmindist",
        "pixelsamples dimensions",
    ),
];

const INTEGRATORS: Known = &[
    (
        "path volpath",
        "maxdepth rrthreshold lightsamplestrategy lightsampler regularize",
    ),
    ("directlighting", "maxdepth strategy"),
    ("whitted simplevolpath lightpath randomwalk", "maxdepth"),
    ("simplepath", "maxdepth samplelights samplebsdf"),
    (
        "bdpt",
        "maxdepth lightsamplestrategy visualizestrategies visualizeweights regularize",
    ),
    (
        "mlt",
        "maxdepth bootstrapsamples chains mutationsperpixel largestepprobability sigma regularize",
    ),
    (
        "sppm",
        "maxdepth iterations numiterations photonsperiteration imagewritefrequency radius seed",
    ),
    // Of the authors of points and lines.
    (
        "pointline",
        "maxdepth method strategy1 strategy2 angle1 angle2 stratified",
    ),
    (
        OTHER_PICTURES,
        "nsamples cossample maxdistance function filename skipbad imagefilename",
    ),
];

/// Integrators whose pictures are not of radiance.
const OTHER_PICTURES: &str = "ao ambientocclusion function";

const ACCELERATORS: Known = &[
    ("bvh", "splitmethod maxnodeprims"),
    (
        "kdtree",
        "intersectcost traversalcost emptybonus maxprims maxdepth",
    ),
];

/// Options, and those that change the picture where they are true.
const OPTIONS: &str = "disablepixeljitter disablewavelengthjitter displacementedgescale \
                       msereferenceimage msereferenceout pixelstats rendercoordsys seed wavefront";
const OF_THE_PICTURE: [&str; 2] = ["forcediffuse", "disabletexturefiltering"];

impl Loader {
    /// `Sampler "halton" …`, `Integrator "path" …`, `Accelerator "bvh" …`
    pub(super) fn rendering_option(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let (what, known) = match lexer.word(token) {
            b"Sampler" => ("sampler", SAMPLERS),
            b"Accelerator" => ("accelerator", ACCELERATORS),
            _ => ("integrator", INTEGRATORS),
        };
        let (name, params) = self.named_params(lexer, token, what)?;
        let Some((_, parameters)) = known.iter().find(|(names, _)| is_one_of(&name, names)) else {
            let names = known.iter().flat_map(|(names, _)| names.split(' '));
            let message = format!("unknown {what} `{}`", shorten(&name));
            let place = |e: SceneError| e.at(params.at(), "ignored").suggest(nearest(&name, names));
            let kind = ErrorKind::UnknownName;
            return self.base.warnings.warn(kind, message, place);
        };
        params.ignore_all_of(parameters);
        // pbrt-v3 has a crop here, whose picture is black around it.
        if what == "integrator" && params.has("pixelbounds") {
            params.ignore(&["pixelbounds"]);
            let message = "`pixelbounds` of an integrator is not supported";
            let label = "the whole picture is drawn";
            self.base.unsupported(message, label, params.at())?;
        }
        if is_one_of(&name, OTHER_PICTURES) && what == "integrator" {
            let message = format!("the integrator `{name}` is not supported");
            self.base
                .unsupported(message, "direct light is drawn", params.at())?;
        }
        self.warn_unused(&params)
    }

    /// `Option "bool name" true`
    pub(super) fn option(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let params = Params::parse(lexer, "`Option`".into(), token.span)?;
        params.ignore_all_of(OPTIONS);
        for name in OF_THE_PICTURE {
            if params.bool_or(name, false)? {
                let message = format!("the option `{name}` is not supported");
                self.base.unsupported(message, "ignored", params.at())?;
            }
        }
        self.warn_unused(&params)
    }
}

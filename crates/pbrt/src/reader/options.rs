//! pbrt's rendering options: `Sampler`, `Integrator`, `Accelerator` and `Option`. They are ignored,
//! as linelit's own options decide how pictures are computed. There are warnings about options that
//! would change the expected picture, and about unknown names.

use super::lexer::{Lexer, Token};
use super::params::Params;
use super::{Loader, is_one_of};
use linelit_assembly::{ErrorKind, Result, SceneError, nearest, shorten};

/// The types of a directive with their parameters: each entry has names of types, separated by
/// blanks, and the names of the parameters that these types have.
type Known = &'static [(&'static str, &'static str)];

/// The samplers of both versions.
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

/// The integrators of both versions.
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
    // The integrator of the authors of the papers on points and lines.
    (
        "pointline",
        "maxdepth method strategy1 strategy2 angle1 angle2 stratified",
    ),
    (
        OTHER_PICTURES,
        "nsamples cossample maxdistance function filename skipbad imagefilename",
    ),
];

/// The integrators whose pictures do not show radiance.
const OTHER_PICTURES: &str = "ao ambientocclusion function";

/// The accelerators of both versions.
const ACCELERATORS: Known = &[
    ("bvh", "splitmethod maxnodeprims"),
    (
        "kdtree",
        "intersectcost traversalcost emptybonus maxprims maxdepth",
    ),
];

/// The parameters of `Option` that do not change the expected picture.
const OPTIONS: &str = "disablepixeljitter disablewavelengthjitter displacementedgescale \
                       msereferenceimage msereferenceout pixelstats rendercoordsys seed wavefront";
/// The parameters of `Option` that change the picture where they are true.
const OF_THE_PICTURE: [&str; 2] = ["forcediffuse", "disabletexturefiltering"];

impl Loader {
    /// Executes `Sampler "halton" …`, `Integrator "path" …`, `Accelerator "bvh" …`.
    pub(super) fn rendering_option(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        // Warn about unknown types.
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
        // Warn about a crop (pbrt-v3's picture is black around it) and about integrators of other
        // pictures, and ignore the other parameters.
        params.ignore_all_of(parameters);
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

    /// Executes `Option "bool name" true`.
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

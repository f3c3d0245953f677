//! Long pictures of `render`: a plan beside the picture keeps what is done, until that is whole.

use super::aovs::Rendered;
use super::picture::{Cut, PicturePlan, Wanted, pixel_seconds};
use super::units::work_off;
use crate::args::{Checkpoints, RenderArgs};
use crate::folder::{Lock, remove_all};
use crate::output::note;
use anyhow::{Result, anyhow};
use linelit_film::Tile;
use linelit_integrator::Renderer;
use linelit_plan::{Folder, Input, PlanError, Shard};
use linelit_scene::Scene;
use rayon::ThreadPool;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Pictures of less are not kept: seconds of one thread, as guessed.
const LONG: f64 = 30.0;

/// What is done of a picture. The folder is ours until this value is dropped.
pub(super) struct Kept {
    path: PathBuf,
    folder: Folder,
    plan: PicturePlan,
    _lock: Option<Lock>,
}

/// Whether what is done of such a picture is to be kept.
pub(super) fn wanted(args: &RenderArgs, scene: &Scene, window: Tile) -> bool {
    match args.checkpoints {
        // Of what parts do not say.
        _ if args.explain => false,
        Checkpoints::Never => false,
        Checkpoints::Always => true,
        Checkpoints::Auto => pixel_seconds(scene, &args.picture) * window.area() as f64 >= LONG,
    }
}

impl Kept {
    /// Begins to keep a picture, or goes on with what an interrupted command kept.
    pub(super) fn open(
        args: &RenderArgs,
        scene: &Scene,
        window: Tile,
        input: Input,
    ) -> Result<Self> {
        let path = beside(&args.output, "plan");
        let shown = args.output.display();
        let lock = Lock::acquire(&beside(&args.output, "lock"), |holder| {
            format!("process {holder} is rendering {shown}: wait for it, or choose another name")
        })?;
        if args.fresh {
            remove_all(&path)?;
        }
        let wanted = Wanted {
            scene: &args.scene,
            read: &args.common.read,
            picture: &args.picture,
            window,
        };
        let plan = wanted.plan(scene, input, Cut::default())?;
        let folder = Folder::create(&path, &plan, &BTreeMap::new()).map_err(|e| match e {
            PlanError::Refused(why) => anyhow!(
                "{why}. An interrupted picture is there: the command that began it goes on, --fresh \
                 begins anew"
            ),
            other => other.into(),
        })?;
        let plan = PicturePlan::open(&folder)?;
        Ok(Self {
            path,
            folder,
            plan,
            _lock: lock,
        })
    }

    /// Renders what is left, and puts all of it together.
    pub(super) fn render(
        &self,
        renderer: &Renderer<'_>,
        pool: &ThreadPool,
    ) -> Result<(Rendered, Map<String, Value>)> {
        let before = self.folder.status()?;
        if before.done > 0 {
            note(format_args!(
                "note: going on with an interrupted picture, {} of {} units are done (--fresh \
                 begins anew)",
                before.done, before.units
            ));
        }
        let threads = pool.current_num_threads();
        let go_on = "the same command";
        work_off(&self.folder, Shard::ALL, threads, go_on, |options| {
            Ok(self.plan.run_with(renderer, &self.folder, options)?)
        })?;
        self.plan.gather(&self.folder)
    }

    /// Removes what was kept: the picture is whole.
    pub(super) fn finish(self) -> Result<()> {
        remove_all(&self.path)
    }
}

/// The name of something that stands beside a picture for a while.
fn beside(picture: &Path, what: &str) -> PathBuf {
    let name = picture.file_name().unwrap_or_default().to_string_lossy();
    picture.with_file_name(format!(".{name}.linelit-{what}"))
}

//! Long pictures of `render`: a plan beside the picture keeps what is done, until that is whole.

use super::aovs::Rendered;
use super::bar;
use super::cost::Cost;
use super::picture::{Cut, PicturePlan, Wanted};
use crate::args::{Checkpoints, RenderArgs};
use crate::folder::{Lock, remove_all};
use crate::interrupt;
use crate::output::note;
use crate::program::TryAgain;
use anyhow::{Context as _, Result, anyhow};
use linelit_film::Tile;
use linelit_integrator::Renderer;
use linelit_plan::{Event, Folder, Input, PlanError, Run};
use rayon::ThreadPool;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Pictures of less are not kept: seconds of one thread, as guessed.
const LONG: f64 = 30.0;
/// And this without a look at them.
const ROUGHLY_LONG: f64 = 10.0;

/// What is done of a picture. The folder is ours until this value is dropped.
pub(super) struct Kept {
    path: PathBuf,
    folder: Folder,
    plan: PicturePlan,
    _lock: Option<Lock>,
}

/// What such a picture costs, if what is done of it is to be kept.
pub(super) fn wanted(args: &RenderArgs, renderer: &Renderer<'_>, window: Tile) -> Option<Cost> {
    let find = || Cost::find(renderer, &args.picture, window);
    match args.checkpoints {
        // Of one machine's times, or of what parts do not say.
        _ if args.calibrate || args.explain => None,
        Checkpoints::Never => None,
        Checkpoints::Always => Some(find()),
        Checkpoints::Auto => {
            let rough = Cost::rough(renderer.scene(), &args.picture, window).of(window);
            let cost = (rough >= ROUGHLY_LONG).then(find);
            cost.filter(|cost| cost.of(window) >= LONG)
        }
    }
}

impl Kept {
    /// Begins to keep a picture, or goes on with what an interrupted command kept.
    pub(super) fn open(
        args: &RenderArgs,
        film: [u32; 2],
        window: Tile,
        input: Input,
        cost: &Cost,
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
            film,
            window,
        };
        let plan = wanted.plan(input, Cut::default(), cost)?;
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
        interrupt::watch().context("watching for signals")?;
        let progress = bar("rendering");
        progress.set_length(self.folder.units().into());
        let options = Run {
            threads: pool.current_num_threads(),
            stop: &interrupt::stopped,
            note: &|event| match event {
                Event::Done(_) | Event::Found(_) => progress.inc(1),
                Event::Broken(unit, why) => {
                    note(format_args!("note: {}, once more: {why}", unit.name));
                }
                _ => {}
            },
            ..Run::default()
        };
        let before = self.folder.status()?;
        if before.done > 0 {
            note(format_args!(
                "note: going on with an interrupted picture, {} of {} units are done (--fresh \
                 begins anew)",
                before.done, before.units
            ));
        }
        let ran = self.plan.run_with(renderer, &self.folder, &options);
        progress.finish_and_clear();
        match ran {
            Ok(_) => self.plan.gather(&self.folder),
            Err(PlanError::Interrupted) => {
                let status = self.folder.status()?;
                Err(TryAgain(format!(
                    "interrupted: {} of {} units are done; the same command goes on",
                    status.done, status.units
                ))
                .into())
            }
            Err(e) => Err(e.into()),
        }
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

//! The units of a study of scenes: their list, the computation of each one, and how their parts
//! become a record and its pictures.

use super::pictures::{
    self, DUEL_SECONDS, RenderedPicture, TRUE_SAMPLES, TRUE_TRIALS, comparison, duel,
};
use super::spec::{Budget, Gallery, method};
use super::stage::Work;
use super::words::entry;
use super::{Targets, all_pixels, render};
use crate::engine::{
    Design, Gathering, Job, Part, Planned, Results, Unit, from_bytes, measure, to_bytes,
};
use crate::report::{Exhibits, Picture, scientific};
use crate::tables::{GalleryRow, SceneRecord, StudyRecord};
use anyhow::{Context as _, Result, bail, ensure};
use indicatif::ProgressBar;
use linelit_film::{Exposure, FilmError, Image, Tile};
use linelit_integrator::{Renderer, Settings};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A unit of a study of scenes: a view, and a piece of work on it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneUnit {
    /// The number of the view ([`StudySpec::views`](super::StudySpec::views)).
    pub view: usize,
    /// The work of the unit.
    pub piece: Piece,
}

/// The kinds of work that a unit can do.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Piece {
    /// A part of the reference or of the measurements.
    Errors(Unit),
    /// A part of the reference of the gallery.
    GalleryReference(Unit),
    /// A picture of the gallery, by its index in the list of the gallery's pictures.
    GalleryPicture(usize),
    /// The pictures of the report: points and lines for the same time, or the scene alone.
    Exhibit,
}

/// A unit before it is computed.
#[derive(Clone, Debug)]
pub struct PlannedUnit {
    /// The unit.
    pub unit: SceneUnit,
    /// The name of the unit in messages.
    pub name: String,
    /// An estimate of the unit's processor time, in seconds.
    pub seconds: f64,
    /// The indices of the units whose parts this unit reads.
    pub needs: Range<usize>,
}

/// A function that calls another with the numbers and parts of units, in the order of their
/// numbers.
pub type EachPart<'a> = &'a dyn Fn(&mut dyn FnMut(usize, Vec<u8>) -> Result<()>) -> Result<()>;

/// A function that reads the part of a unit; `None` where it is missing.
pub type PartOf<'a> = &'a dyn Fn(usize) -> Result<Option<Vec<u8>>>;

impl Work<'_, '_, '_> {
    /// Returns all units, view by view. All scenes are opened first, so that an error in the last
    /// one is found before the first is measured.
    ///
    /// # Errors
    /// If a scene cannot be loaded, a pixel is outside it, no ray of the camera meets a surface at
    /// the pixels, or the study does not fit into memory.
    pub fn plan(&self) -> Result<Vec<PlannedUnit>> {
        // Open all scenes.
        (0..self.views.len()).try_for_each(|view| self.job(view).map(drop))?;
        let mut planned = Vec::new();
        for (view, about) in self.views.iter().enumerate() {
            let mut add = |piece, name: String, seconds| {
                planned.push(PlannedUnit {
                    unit: SceneUnit { view, piece },
                    name: format!("{}: {name}", about.label),
                    seconds,
                    needs: 0..0,
                });
            };
            // List the references and measurements of the view.
            for Planned { unit, seconds } in self.job(view)?.units() {
                let name = match &unit {
                    Unit::Reference { round, integrals } => {
                        format!("reference {round} of {integrals:?}")
                    }
                    Unit::Cells { cells, integrals } => {
                        let first = self.design.cells().nth(cells.start);
                        let (method, samples) = first.context("no such measurement")?;
                        let (estimator, sampler) = (&method.estimator, &method.sampler);
                        let more = match cells.len() {
                            1 => format!(" of {integrals:?}"),
                            count => format!(" and {} more", count - 1),
                        };
                        format!("{estimator} ({sampler}) with {samples} samples{more}")
                    }
                };
                add(Piece::Errors(unit), name, seconds);
            }
            // List the pictures of the gallery and of the report.
            if self.spec.gallery.is_some() && about.with_gallery {
                self.with_gallery(view, |wanted, job| {
                    for Planned { unit, seconds } in job.reference_units(wanted.reference_rounds) {
                        let name = "reference of the gallery".to_owned();
                        add(Piece::GalleryReference(unit), name, seconds);
                    }
                    for (k, settings) in self.spec.pictures(wanted).into_iter().enumerate() {
                        let name = self.spec.name(&settings);
                        let seconds = match wanted.budget {
                            Budget::Seconds(seconds) => 1.5 * seconds,
                            Budget::Samples(n) => job.trial_seconds(&method(settings), n),
                        };
                        add(Piece::GalleryPicture(k), name, seconds);
                    }
                    Ok(())
                })?;
            }
            let seconds = self.exhibit_seconds(view)?;
            add(Piece::Exhibit, "picture".to_owned(), seconds);
        }
        // Find the units that each unit needs, now that all have their numbers.
        let units: Vec<SceneUnit> = planned.iter().map(|p| p.unit.clone()).collect();
        for (number, planned) in planned.iter_mut().enumerate() {
            planned.needs = self.needs(&units, number);
        }
        Ok(planned)
    }

    /// Returns an estimate of the processor time of the pictures of [`Work::exhibit`], in seconds.
    fn exhibit_seconds(&self, view: usize) -> Result<f64> {
        let (job, aspect) = (self.job(view)?, self.opened(view)?.aspect);
        let picture = |side, settings: Settings, samples| {
            let pixels = fitted(aspect, side).map(f64::from).iter().product::<f64>();
            let seconds = job.trial_seconds(&method(settings), samples);
            seconds * pixels / job.problem.pixels as f64
        };
        Ok(match self.spec.duel {
            // The true picture takes the most time, where no estimator is without noise.
            Some(wanted) => {
                let settings = job.problem.true_settings(self.spec.spheres);
                DUEL_SECONDS + picture(wanted.side, settings, TRUE_SAMPLES * TRUE_TRIALS)
            }
            None => {
                let settings = Settings::default();
                picture(self.spec.picture_side, settings, settings.samples)
            }
        })
    }

    /// Returns the numbers of the units whose parts a unit reads. Measurements need their
    /// reference, pictures of the gallery need the reference of the gallery, and pictures that take
    /// the same time need all measurements of the view, whose times and errors they are chosen by.
    fn needs(&self, units: &[SceneUnit], number: usize) -> Range<usize> {
        let own = &units[number];
        let reads = |piece: &Piece| match (&own.piece, piece) {
            (Piece::Errors(Unit::Cells { .. }), Piece::Errors(Unit::Reference { .. }))
            | (Piece::GalleryPicture(_), Piece::GalleryReference(_)) => true,
            (Piece::Exhibit, Piece::Errors(_)) => self.spec.duel.is_some(),
            _ => false,
        };
        let read = |unit: &SceneUnit| unit.view == own.view && reads(&unit.piece);
        let view = units.partition_point(|unit| unit.view < own.view);
        let first = view + units[view..].iter().position(read).unwrap_or(0);
        let count = units[first..].iter().take_while(|unit| read(unit)).count();
        first..first + count
    }

    /// Measures the whole study and adds it to `record`; returns what a report shows of the scenes,
    /// without galleries.
    ///
    /// # Errors
    /// As [`Work::plan`].
    pub fn whole(&self, record: &mut StudyRecord) -> Result<Exhibits> {
        let mut exhibits = self.exhibits();
        for (view, results) in self.measured()?.iter().enumerate() {
            self.add_rows(view, results, record)?;
            let shown = self.exhibit(view, results)?;
            show(&self.view(view)?.label, &shown, &[], record, &mut exhibits)?;
        }
        Ok(exhibits)
    }

    /// Measures all views.
    fn measured(&self) -> Result<Vec<Results>> {
        let measure = |view| self.job(view).map(measure);
        (0..self.views.len()).map(measure).collect()
    }

    /// Returns exhibits without pictures.
    fn exhibits(&self) -> Exhibits {
        Exhibits {
            compared: self.spec.estimators.iter().map(entry).collect(),
            ..Exhibits::default()
        }
    }

    /// Calls a function with the gallery of a view, and with a job that measures only the reference
    /// of its pictures.
    fn with_gallery<T>(
        &self,
        view: usize,
        call: impl FnOnce(&Gallery, Job<'_, Targets<'_>>) -> Result<T>,
    ) -> Result<T> {
        let wanted = self.spec.gallery.as_ref();
        let wanted = wanted.context("a study without a gallery")?;
        let scene = self.resized(view, [wanted.width, wanted.height])?;
        let renderer = Renderer::new(&scene);
        let targets = Targets::find(&renderer, &all_pixels(wanted.width, wanted.height));
        let job = Job {
            problem: &targets,
            truth: &targets.truth(self.spec.spheres),
            design: &Design::new(Vec::new(), Vec::new()),
        };
        call(wanted, job)
    }

    /// Computes a unit on the threads of the rayon pool in which it is called, and returns its part
    /// as bytes. `needed` provides the parts of [`PlannedUnit::needs`]. The part is the same on
    /// every machine, except for times, and for the numbers of samples that follow from times in
    /// pictures that take the same time.
    ///
    /// # Errors
    /// If the scene cannot be opened, `needed` fails, or the unit does not belong to this study.
    pub fn compute(
        &self,
        units: &[SceneUnit],
        number: usize,
        needed: EachPart<'_>,
    ) -> Result<Vec<u8>> {
        let SceneUnit { view, piece } = units.get(number).context("no such unit")?;
        match piece {
            Piece::Errors(unit) => {
                let job = self.job(*view)?;
                // Measure against the reference, which is gathered from its parts at first.
                let gathered = || Ok(gathered(self.job(*view)?, units, needed)?.reference());
                let part = job.compute(unit, || self.reference(*view, gathered))?;
                Ok(to_bytes(&part))
            }
            Piece::GalleryReference(unit) => self.with_gallery(*view, |_, job| {
                let part = job.compute(unit, || bail!("the gallery has no measurements"))?;
                Ok(to_bytes(&part))
            }),
            Piece::GalleryPicture(k) => self.with_gallery(*view, |wanted, job| {
                // Render a picture of the gallery, and score it against the gallery's reference.
                let all = self.spec.pictures(wanted);
                let settings = *all.get(*k).context("no such picture")?;
                let targets = job.problem;
                let reference = gathered(job, units, needed)?.reference();
                let picture = pictures::picture(self.spec, wanted, targets, &reference, settings);
                Ok(to_bytes(&[picture].as_slice()))
            }),
            Piece::Exhibit => {
                let results = gathered(self.job(*view)?, units, needed)?.results();
                Ok(to_bytes(&self.exhibit(*view, &results)?))
            }
        }
    }

    /// Renders points and lines for the same time, if the study should have them and has measured
    /// both; otherwise the scene.
    fn exhibit(&self, view: usize, results: &Results) -> Result<Vec<RenderedPicture>> {
        let aspect = self.opened(view)?.aspect;
        // Render points and lines for the same time.
        if let Some(wanted) = &self.spec.duel {
            let size = fitted(aspect, wanted.side);
            let scene = self.resized(view, size)?;
            let rows: Vec<_> = results.cells.iter().map(|cell| &cell.row).collect();
            if let Some(shown) = duel(self.spec, wanted, &rows, &scene, size) {
                return Ok(shown);
            }
        }
        // Render the scene itself by lines.
        let size = fitted(aspect, self.spec.picture_side);
        let scene = self.resized(view, size)?;
        let window = Tile::whole(size[0], size[1]);
        let (renderer, settings) = (Renderer::new(&scene), Settings::default());
        let label = &self.view(view)?.label;
        Ok(vec![RenderedPicture {
            name: format!("{label}: line-analytic, 16 stratified lines a point"),
            samples: settings.samples,
            seconds: f64::NAN,
            mrse: f64::NAN,
            image: render(&renderer, &settings, window, &ProgressBar::hidden()).0,
        }])
    }

    /// Puts parts together: adds the results to `record`, and returns what the report shows of
    /// them. Measurements and pictures of which a part is missing are left out.
    ///
    /// # Errors
    /// If a scene cannot be opened, `part` fails, or its bytes are not a part of this study.
    pub fn gather(
        &self,
        units: &[SceneUnit],
        part: PartOf<'_>,
        record: &mut StudyRecord,
    ) -> Result<Exhibits> {
        let mut exhibits = self.exhibits();
        for view in 0..self.views.len() {
            // Collect the parts of the view.
            let mut gathering = Gathering::new(self.job(view)?);
            let (mut gallery, mut exhibit) = (Vec::new(), Vec::new());
            for (k, unit) in units.iter().enumerate().filter(|(_, u)| u.view == view) {
                match &unit.piece {
                    Piece::Errors(_) => {
                        let bytes = part(k)?;
                        bytes.map_or(Ok(()), |bytes| add(&mut gathering, units, k, &bytes))?;
                    }
                    Piece::GalleryReference(_) => {}
                    Piece::GalleryPicture(_) => gallery.extend(shown(part(k)?)?),
                    Piece::Exhibit => exhibit = shown(part(k)?)?,
                }
            }
            // Add its rows and pictures.
            self.add_rows(view, &gathering.results(), record)?;
            let label = &self.view(view)?.label;
            show(label, &exhibit, &gallery, record, &mut exhibits)?;
        }
        Ok(exhibits)
    }

    /// Adds the results of a view, with the facts about its scene, to the record.
    fn add_rows(&self, view: usize, results: &Results, record: &mut StudyRecord) -> Result<()> {
        let (about, opened, built) = (self.view(view)?, self.opened(view)?, self.built(view)?);
        let scene = SceneRecord {
            scene: about.label.clone(),
            triangles: opened.scene.triangles.len(),
            load_seconds: opened.load_seconds,
            build_seconds: built.seconds,
            hierarchy_bytes: built.renderer.occluders().memory(),
            ..SceneRecord::default()
        };
        let (pixels, methods) = (about.pixels.to_string(), &self.design.methods);
        record.add(scene, &pixels, methods, results, &self.spec.papers);
        Ok(())
    }
}

/// Puts together the parts of a job that `needed` provides.
fn gathered<'a, 'r>(
    job: Job<'a, Targets<'r>>,
    units: &[SceneUnit],
    needed: EachPart<'_>,
) -> Result<Gathering<'a, Targets<'r>>> {
    let mut gathering = Gathering::new(job);
    needed(&mut |k, bytes| add(&mut gathering, units, k, &bytes))?;
    Ok(gathering)
}

/// Adds the part of one unit.
fn add(
    gathering: &mut Gathering<'_, Targets<'_>>,
    units: &[SceneUnit],
    number: usize,
    bytes: &[u8],
) -> Result<()> {
    let piece = units.get(number).map(|unit| &unit.piece);
    let Some(Piece::Errors(unit) | Piece::GalleryReference(unit)) = piece else {
        bail!("unit {number} is no part of a reference and no measurement");
    };
    gathering.add(unit, from_bytes::<Part>(bytes)?);
    Ok(())
}

/// Decodes the pictures of a unit; a missing part has none.
fn shown(bytes: Option<Vec<u8>>) -> Result<Vec<RenderedPicture>> {
    let Some(bytes) = bytes else {
        return Ok(Vec::new());
    };
    let pictures: Vec<RenderedPicture> = from_bytes(&bytes)?;
    for Image { width, height, rgb } in pictures.iter().map(|p| &p.image) {
        let pixels = *width as usize * *height as usize;
        ensure!(rgb.len() == pixels, "a picture lacks pixels");
    }
    Ok(pictures)
}

/// Adds pictures to what the report shows of a scene.
fn show(
    label: &str,
    exhibit: &[RenderedPicture],
    gallery: &[RenderedPicture],
    record: &mut StudyRecord,
    exhibits: &mut Exhibits,
) -> Result<(), FilmError> {
    let mut pictures = Vec::new();
    // The comparison shows the scene already, so that its pictures are not shown again.
    if let Some(compared) = comparison(exhibit)? {
        exhibits.comparisons.insert(label.to_owned(), compared);
    } else {
        for one in exhibit {
            pictures.push(Picture::exposed(
                &one.image,
                exposure(&one.image),
                &one.name,
            )?);
        }
    }
    // Expose all pictures of the gallery like the first one.
    for one in gallery {
        let caption = format!(
            "{}: N = {}, {:.2} s of CPU, MRSE {}",
            one.name,
            one.samples,
            one.seconds,
            scientific(one.mrse)
        );
        let exposure = exposure(&gallery[0].image);
        pictures.push(Picture::exposed(&one.image, exposure, &caption)?);
        record.gallery.push(GalleryRow {
            scene: label.to_owned(),
            estimator: one.name.clone(),
            samples: one.samples,
            cpu_seconds: one.seconds,
            mrse: one.mrse,
        });
    }
    exhibits.pictures.insert(label.to_owned(), pictures);
    Ok(())
}

/// Returns a size with this many pixels on the longer side and the given proportions.
fn fitted([w, h]: [u32; 2], side: u32) -> [u32; 2] {
    [w, h].map(|length| {
        let scaled = u64::from(side) * u64::from(length) / u64::from(w.max(h));
        u32::try_from(scaled).unwrap_or(side).max(1)
    })
}

/// Returns the exposure by which a tenth of the pixels are white, so that a light in the picture
/// does not make the others dark.
fn exposure(image: &Image) -> Exposure {
    Exposure::fitting(image, 0.9)
}

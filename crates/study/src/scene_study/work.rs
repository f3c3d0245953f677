//! A study of scenes in units, each computed by itself, and what they make together.

use super::duel::{comparison, duel};
use super::shown::{self, Shown};
use super::spec::{Budget, Gallery};
use super::stage::Work;
use super::{Targets, gallery, render};
use crate::engine::{Broken, Gathering, Part, Results, Unit, from_bytes, to_bytes};
use crate::report::{Exhibits, Picture, scientific};
use crate::tables::{GalleryRow, SceneRecord, StudyRecord};
use anyhow::{Context as _, Result, bail};
use indicatif::ProgressBar;
use linelit_film::{Exposure, FilmError, Image, Tile};
use linelit_integrator::{Renderer, Settings};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A piece of a study of scenes: its view, and what is done there.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneUnit {
    /// Number of the view ([`StudySpec::views`](super::StudySpec::views)).
    pub view: usize,
    /// What is done.
    pub piece: Piece,
}

/// What a unit does.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Piece {
    /// A part of the reference or of the measurements.
    Errors(Unit),
    /// A part of the reference of the gallery.
    GalleryReference(Unit),
    /// A picture of the gallery, by its number.
    GalleryPicture(usize),
    /// The scene's picture, or points and lines for the same time.
    Exhibit,
}

/// A unit before it is computed.
#[derive(Clone, Debug)]
pub struct PlannedUnit {
    /// The unit.
    pub unit: SceneUnit,
    /// What people call it.
    pub name: String,
    /// A guess of its processor seconds.
    pub seconds: f64,
    /// Numbers of the units whose parts it reads.
    pub needs: Range<usize>,
}

/// Hands on numbers and parts of units, in the order of their numbers.
pub type EachPart<'a> = &'a dyn Fn(&mut dyn FnMut(usize, Vec<u8>) -> Result<()>) -> Result<()>;

/// Seconds that the pictures of points and lines for the same time are guessed to take.
const EXHIBIT_SECONDS: f64 = 4.0;

impl Work<'_, '_, '_> {
    /// All units, view by view. All scenes are opened, so that what is wrong with the last one is
    /// found before the first is measured.
    ///
    /// # Errors
    /// If a scene cannot be loaded or has nothing to light, a pixel is outside it, the camera sees
    /// nothing at the pixels, or the study does not fit into memory.
    pub fn plan(&self) -> Result<Vec<PlannedUnit>> {
        (0..self.views.len()).try_for_each(|view| self.job(view).map(drop))?;
        let mut units = Vec::new();
        for view in 0..self.views.len() {
            self.plan_errors(view, &mut units)?;
            let first = units.iter().position(|u: &PlannedUnit| u.unit.view == view);
            let needs = first.unwrap_or(0)..units.len();
            if let Some(gallery) = self.gallery(view) {
                self.plan_gallery(view, gallery, &mut units)?;
            }
            units.push(PlannedUnit {
                name: format!("{}: picture", self.view(view)?.label),
                unit: SceneUnit {
                    view,
                    piece: Piece::Exhibit,
                },
                seconds: EXHIBIT_SECONDS,
                // What is for the same time goes by the times found.
                needs: if self.spec.duel.is_some() {
                    needs
                } else {
                    0..0
                },
            });
        }
        Ok(units)
    }

    /// Computes all units, one after the other in memory, and adds to `record` what they make
    /// together; gives what a report shows of it.
    ///
    /// # Errors
    /// As [`Work::plan`].
    pub fn whole(&self, record: &mut StudyRecord) -> Result<Exhibits> {
        let mut exhibits = Exhibits {
            compared: self.spec.compared(),
            ..Exhibits::default()
        };
        self.compute_some(|_| true, record, &mut exhibits)?;
        Ok(exhibits)
    }

    /// As [`Work::whole`], without pictures: references and measurements alone.
    ///
    /// # Errors
    /// As [`Work::plan`].
    pub fn whole_without_pictures(&self, record: &mut StudyRecord) -> Result<()> {
        let wanted = |piece: &Piece| matches!(piece, Piece::Errors(_));
        self.compute_some(wanted, record, &mut Exhibits::default())
    }

    fn compute_some(
        &self,
        wanted: impl Fn(&Piece) -> bool,
        record: &mut StudyRecord,
        exhibits: &mut Exhibits,
    ) -> Result<()> {
        let planned = self.plan()?;
        let units: Vec<SceneUnit> = planned.iter().map(|p| p.unit.clone()).collect();
        let mut parts: Vec<Option<Vec<u8>>> = Vec::new();
        for (k, unit) in planned.into_iter().enumerate() {
            let needed = |each: &mut dyn FnMut(usize, Vec<u8>) -> Result<()>| {
                let mut needs = unit.needs.clone();
                needs.try_for_each(|n| parts[n].clone().map_or(Ok(()), |part| each(n, part)))
            };
            let is_wanted = wanted(&unit.unit.piece);
            let part = is_wanted.then(|| self.compute(&units, k, &needed));
            parts.push(part.transpose()?);
        }
        let complete = parts.iter().all(Option::is_some);
        let mut part = |k: usize| Ok(parts.get(k).cloned().flatten());
        self.gather(&units, &mut part, complete, record, exhibits)
    }

    fn gallery(&self, view: usize) -> Option<&Gallery> {
        let wanted = self.views.get(view)?.with_gallery;
        self.spec.gallery.as_ref().filter(|_| wanted)
    }

    fn plan_errors(&self, view: usize, units: &mut Vec<PlannedUnit>) -> Result<()> {
        let label = &self.view(view)?.label;
        let job = self.job(view)?;
        let first = units.len();
        let mut reference = first..first;
        for planned in job.units() {
            let (name, needs) = match &planned.unit {
                Unit::Reference { round, integrals } => {
                    reference.end = units.len() + 1;
                    (format!("{label}: reference {round} of {integrals:?}"), 0..0)
                }
                Unit::Cells { cells, integrals } => (
                    format!("{label}: measurements {cells:?} of {integrals:?}"),
                    reference.clone(),
                ),
            };
            units.push(PlannedUnit {
                unit: SceneUnit {
                    view,
                    piece: Piece::Errors(planned.unit),
                },
                name,
                seconds: planned.seconds,
                needs,
            });
        }
        Ok(())
    }

    fn plan_gallery(
        &self,
        view: usize,
        wanted: &Gallery,
        units: &mut Vec<PlannedUnit>,
    ) -> Result<()> {
        let label = &self.view(view)?.label;
        let scene = self.resized(view, [wanted.width, wanted.height])?;
        let first = units.len();
        gallery::with_job(self.spec, wanted, &scene, |job| {
            for planned in job.reference_units(wanted.reference_rounds) {
                units.push(PlannedUnit {
                    name: format!("{label}: reference of the gallery"),
                    unit: SceneUnit {
                        view,
                        piece: Piece::GalleryReference(planned.unit),
                    },
                    seconds: planned.seconds,
                    needs: 0..0,
                });
            }
        });
        let needs = first..units.len();
        let seconds = match wanted.budget {
            Budget::Seconds(seconds) => 1.5 * seconds,
            Budget::Samples(_) => 1.0,
        };
        let pictures = wanted.estimators.iter().enumerate();
        units.extend(pictures.map(|(k, estimator)| PlannedUnit {
            name: format!("{label}: {estimator}"),
            unit: SceneUnit {
                view,
                piece: Piece::GalleryPicture(k),
            },
            seconds,
            needs: needs.clone(),
        }));
        Ok(())
    }

    /// Computes a unit on the threads of the rayon pool that it is called in. `needed` hands on the
    /// parts of [`PlannedUnit::needs`]. All but times, and the numbers of samples that follow from
    /// them in pictures for the same time, is the same on every machine.
    ///
    /// # Errors
    /// If the scene cannot be opened, what `needed` fails with, and for what is no unit of this
    /// study.
    pub fn compute(
        &self,
        units: &[SceneUnit],
        number: usize,
        needed: EachPart<'_>,
    ) -> Result<Vec<u8>> {
        let unit = units.get(number).context("no such unit")?;
        let view = unit.view;
        match &unit.piece {
            Piece::Errors(errors) => {
                let reference = || {
                    self.reference(view, |gathering| {
                        needed(&mut |k, bytes| add(gathering, units, k, &bytes))
                    })
                };
                let part = self.job(view)?.compute(errors, reference)?;
                Ok(to_bytes(&part))
            }
            Piece::GalleryReference(round) => {
                let wanted = self.gallery(view).context("a study without a gallery")?;
                let scene = self.resized(view, [wanted.width, wanted.height])?;
                gallery::with_job(self.spec, wanted, &scene, |job| {
                    let none = || Err(Broken::of("a reference").into());
                    Ok(to_bytes(&job.compute::<anyhow::Error>(round, none)?))
                })
            }
            Piece::GalleryPicture(k) => {
                let picture = self.gallery_picture(view, *k, |gathering| {
                    needed(&mut |k, bytes| add(gathering, units, k, &bytes))
                })?;
                Ok(shown::to_bytes(vec![picture]))
            }
            Piece::Exhibit if self.spec.duel.is_some() => {
                let mut gathering = Gathering::new(self.job(view)?);
                needed(&mut |k, bytes| add(&mut gathering, units, k, &bytes))?;
                let pictures = self.exhibit(view, &gathering.results())?;
                Ok(shown::to_bytes(pictures))
            }
            Piece::Exhibit => Ok(shown::to_bytes(vec![self.picture(view)?])),
        }
    }

    fn gallery_picture(
        &self,
        view: usize,
        number: usize,
        add_parts: impl FnOnce(&mut Gathering<'_, Targets<'_>>) -> Result<()>,
    ) -> Result<Shown> {
        let wanted = self.gallery(view).context("a study without a gallery")?;
        let estimator = *wanted.estimators.get(number).context("no such picture")?;
        let scene = self.resized(view, [wanted.width, wanted.height])?;
        gallery::with_job(self.spec, wanted, &scene, |job| {
            let mut gathering = Gathering::new(job);
            add_parts(&mut gathering)?;
            let reference = gathering.reference();
            Ok(gallery::picture(
                self.spec,
                wanted,
                job.problem,
                &reference,
                estimator,
            ))
        })
    }

    /// Points and lines for the same time, if the study wants them and has both; else the scene.
    fn exhibit(&self, view: usize, results: &Results) -> Result<Vec<Shown>> {
        if let Some(wanted) = &self.spec.duel {
            let size = fitted(self.opened(view)?.aspect, wanted.side);
            let scene = self.resized(view, size)?;
            let mut record = StudyRecord::default();
            self.add_rows(view, results, &mut record)?;
            if let Some(shown) = duel(self.spec, wanted, &record.rows, &scene, size) {
                return Ok(shown);
            }
        }
        Ok(vec![self.picture(view)?])
    }

    /// The scene.
    fn picture(&self, view: usize) -> Result<Shown> {
        let size = fitted(self.opened(view)?.aspect, self.spec.picture_side);
        let scene = self.resized(view, size)?;
        let window = Tile::whole(size[0], size[1]);
        let (renderer, settings) = (Renderer::new(&scene), Settings::default());
        Ok(Shown {
            name: format!(
                "{}: line-analytic, 16 stratified lines a point",
                self.view(view)?.label
            ),
            samples: settings.samples,
            seconds: f64::NAN,
            mrse: f64::NAN,
            image: render(&renderer, &settings, window, &ProgressBar::hidden()).0,
        })
    }

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

    /// Puts parts together: adds what was found to `record`, and what the report shows of it to
    /// `exhibits`. `part` reads the part of a unit, `None` where it is missing. Measurements that
    /// lack one are left out. Pictures that do are made from what there is, here and now, if
    /// `complete` says so; else they are left out, too.
    ///
    /// # Errors
    /// If a scene cannot be opened, what `part` fails with, and for parts that are none.
    pub fn gather(
        &self,
        units: &[SceneUnit],
        part: &mut dyn FnMut(usize) -> Result<Option<Vec<u8>>>,
        complete: bool,
        record: &mut StudyRecord,
        exhibits: &mut Exhibits,
    ) -> Result<()> {
        for view in 0..self.views.len() {
            let mut gathering = Gathering::new(self.job(view)?);
            let (mut gallery, mut exhibit) = (Vec::new(), None);
            let own = units.iter().enumerate().filter(|(_, u)| u.view == view);
            for (k, unit) in own {
                let bytes = part(k)?;
                match (&unit.piece, bytes) {
                    (Piece::Errors(_), Some(bytes)) => add(&mut gathering, units, k, &bytes)?,
                    (Piece::GalleryPicture(_), Some(bytes)) => {
                        gallery.extend(shown::from_bytes(&bytes)?);
                    }
                    (Piece::GalleryPicture(number), None) if complete => {
                        let reference =
                            |g: &mut Gathering<'_, Targets<'_>>| self.gallery_rounds(view, g);
                        gallery.push(self.gallery_picture(view, *number, reference)?);
                    }
                    (Piece::Exhibit, Some(bytes)) => exhibit = Some(shown::from_bytes(&bytes)?),
                    _ => {}
                }
            }
            let results = gathering.results();
            self.add_rows(view, &results, record)?;
            if exhibit.is_none() && complete {
                exhibit = Some(self.exhibit(view, &results)?);
            }
            let label = &self.view(view)?.label;
            show(
                label,
                &exhibit.unwrap_or_default(),
                &gallery,
                record,
                exhibits,
            )?;
        }
        Ok(())
    }

    /// All rounds of the gallery's reference, computed here.
    fn gallery_rounds(
        &self,
        view: usize,
        gathering: &mut Gathering<'_, Targets<'_>>,
    ) -> Result<()> {
        let wanted = self.gallery(view).context("a study without a gallery")?;
        for planned in gathering.job().reference_units(wanted.reference_rounds) {
            let none = || Err(Broken::of("a reference").into());
            let part = gathering
                .job()
                .compute::<anyhow::Error>(&planned.unit, none)?;
            gathering.add(&planned.unit, part);
        }
        Ok(())
    }
}

/// Adds the part of a unit.
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

/// Adds pictures to what the report shows of a scene.
fn show(
    label: &str,
    exhibit: &[Shown],
    gallery: &[Shown],
    record: &mut StudyRecord,
    exhibits: &mut Exhibits,
) -> Result<(), FilmError> {
    let mut pictures = Vec::new();
    // The comparison shows the scene already.
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

/// A picture's proportions with this many pixels on the longer side.
fn fitted([w, h]: [u32; 2], side: u32) -> [u32; 2] {
    [w, h].map(|length| {
        let scaled = u64::from(side) * u64::from(length) / u64::from(w.max(h));
        u32::try_from(scaled).unwrap_or(side).max(1)
    })
}

/// A tenth of the pixels are white, so that a light in the picture leaves the rest bright.
fn exposure(image: &Image) -> Exposure {
    Exposure::fitting(image, 0.9)
}

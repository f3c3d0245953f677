//! What is said at the terminal of a long study: where it is, and the time left by cost.

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use linelit_papers::scene_study::{Piece, SceneUnit, Work};
use linelit_plan::Plan;
use linelit_study::engine::Unit;
use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Kinds of work whose guesses are wrong by factors of their own.
const CLASSES: usize = 4;

/// Guessed seconds that a kind is believed to be like the others for.
const BELIEF: f64 = 2.0;

/// Guesses of costs, and what was measured of them.
#[derive(Clone, Debug)]
struct Forecast {
    /// Guess and kind of each unit.
    units: Vec<(f64, usize)>,
    left: Vec<bool>,
    /// Guessed and measured seconds of what was done here, by kind.
    done: [[f64; 2]; CLASSES],
    /// Seconds on the wall for a guessed second, before anything is measured.
    prior: f64,
}

impl Forecast {
    fn new(units: Vec<(f64, usize)>, threads: usize) -> Self {
        Self {
            left: vec![true; units.len()],
            units,
            done: [[0.0; 2]; CLASSES],
            prior: 1.0 / threads.max(1) as f64,
        }
    }

    /// A unit is done, in so many seconds if it was done here.
    fn finish(&mut self, number: usize, seconds: Option<f64>) {
        let (Some(left), Some(&(guess, class))) =
            (self.left.get_mut(number), self.units.get(number))
        else {
            return;
        };
        if std::mem::replace(left, false)
            && let Some(seconds) = seconds
        {
            self.done[class][0] += guess;
            self.done[class][1] += seconds;
        }
    }

    /// Seconds for a guessed second: of all kinds together, and of each, which is believed to be
    /// like the others until there is more of it.
    fn ratios(&self) -> [f64; CLASSES] {
        let towards =
            |[guess, seconds]: [f64; 2], ratio: f64| (seconds + BELIEF * ratio) / (guess + BELIEF);
        let all = self
            .done
            .iter()
            .fold([0.0; 2], |sum, d| [sum[0] + d[0], sum[1] + d[1]]);
        let all = towards(all, self.prior);
        self.done.map(|own| towards(own, all))
    }

    /// Seconds that are done and left, both by guesses times what was learnt of them.
    fn seconds(&self) -> [f64; 2] {
        let ratios = self.ratios();
        let mut sums = [0.0; 2];
        for ((guess, class), left) in self.units.iter().zip(&self.left) {
            sums[usize::from(*left)] += guess * ratios[*class];
        }
        sums
    }
}

/// Seconds as one says them of a time to wait.
fn waiting(seconds: f64) -> String {
    if seconds < 90.0 {
        format!("{seconds:.0} s left")
    } else if seconds < 5400.0 {
        format!("{:.0} min left", seconds / 60.0)
    } else {
        format!("{:.1} h left", seconds / 3600.0)
    }
}

/// Where a study is when it computes a unit: the scene, and the measurement, round or picture.
fn place(units: &[SceneUnit], number: usize, labels: &[&str], cells: usize) -> String {
    let Some(unit) = units.get(number) else {
        return String::new();
    };
    // Those of the same kind on the same scene, of which it is one.
    let among = |same: fn(&Piece) -> bool| {
        let own = |u: &&SceneUnit| u.view == unit.view && same(&u.piece);
        let before = units.iter().take(number + 1).filter(own).count();
        format!("{before} of {}", units.iter().filter(own).count())
    };
    let what = match &unit.piece {
        Piece::Errors(Unit::Cells { cells: range, .. }) if range.len() == 1 => {
            format!("cell {} of {cells}", range.end)
        }
        Piece::Errors(Unit::Cells { cells: range, .. }) => {
            format!("cells {} to {} of {cells}", range.start + 1, range.end)
        }
        Piece::Errors(Unit::Reference { .. }) => {
            let same = |p: &Piece| matches!(p, Piece::Errors(Unit::Reference { .. }));
            format!("reference {}", among(same))
        }
        Piece::GalleryReference(_) => {
            let same = |p: &Piece| matches!(p, Piece::GalleryReference(_));
            format!("reference of the pictures {}", among(same))
        }
        Piece::GalleryPicture(_) => {
            let same = |p: &Piece| matches!(p, Piece::GalleryPicture(_));
            format!("picture {}", among(same))
        }
        Piece::Exhibit => "the scene's picture".to_owned(),
    };
    let (scene, label) = (unit.view + 1, labels.get(unit.view).unwrap_or(&""));
    format!("scene {scene} of {}: {label}, {what}", labels.len())
}

const fn class(piece: &Piece) -> usize {
    match piece {
        Piece::Errors(Unit::Reference { .. }) | Piece::GalleryReference(_) => 0,
        Piece::Errors(Unit::Cells { .. }) => 1,
        Piece::GalleryPicture(_) => 2,
        Piece::Exhibit => 3,
    }
}

/// Progress of a study: a line at the terminal, hidden where there is none.
#[derive(Debug)]
pub(super) struct Progress<'a> {
    units: &'a [SceneUnit],
    labels: Vec<&'a str>,
    cells: usize,
    bar: ProgressBar,
    state: Arc<Mutex<State>>,
}

#[derive(Debug)]
struct State {
    forecast: Forecast,
    /// When the unit in hand began, or the last one ended.
    since: Instant,
    /// When there is no more time, whatever is left.
    end: Option<Instant>,
}

impl State {
    /// Seconds left now.
    fn left(&self) -> f64 {
        let [_, left] = self.forecast.seconds();
        let left = (left - self.since.elapsed().as_secs_f64()).max(0.0);
        self.end.map_or(left, |end| {
            left.min(end.saturating_duration_since(Instant::now()).as_secs_f64())
        })
    }
}

impl<'a> Progress<'a> {
    /// Of a plan's units, done by so many threads until a time if there is one.
    pub(super) fn new(
        work: &Work<'a, '_, '_>,
        plan: &Plan,
        units: &'a [SceneUnit],
        threads: usize,
        end: Option<Instant>,
    ) -> Self {
        let costs = plan.units.iter().zip(units);
        let forecast = Forecast::new(
            costs.map(|(u, own)| (u.cost, class(&own.piece))).collect(),
            threads,
        );
        let state = Arc::new(Mutex::new(State {
            forecast,
            since: Instant::now(),
            end,
        }));
        let told = Arc::clone(&state);
        let left = move |_: &ProgressState, out: &mut dyn Write| {
            let state = told.lock().unwrap_or_else(PoisonError::into_inner);
            // A line that cannot be written is not there.
            let _ = out.write_str(&waiting(state.left()));
        };
        let style = ProgressStyle::with_template("{wide_msg} {bar:20} {left:>11}")
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .with_key("left", left);
        let bar = ProgressBar::new(1000).with_style(style);
        bar.enable_steady_tick(Duration::from_millis(500));
        Self {
            units,
            labels: work.labels(),
            cells: work.measurements(),
            bar,
            state,
        }
    }

    /// A unit is begun.
    pub(super) fn begin(&self, number: usize) {
        self.state().since = Instant::now();
        self.bar
            .set_message(place(self.units, number, &self.labels, self.cells));
    }

    /// A unit that was begun here is done.
    pub(super) fn end(&self, number: usize) {
        let mut state = self.state();
        let seconds = state.since.elapsed().as_secs_f64();
        state.since = Instant::now();
        state.forecast.finish(number, Some(seconds));
        self.show(state.forecast.seconds());
    }

    /// A unit was done before.
    pub(super) fn found(&self, number: usize) {
        let mut state = self.state();
        state.forecast.finish(number, None);
        self.show(state.forecast.seconds());
    }

    fn show(&self, [done, left]: [f64; 2]) {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from 0 to 1000"
        )]
        let position = (1000.0 * done / (done + left).max(f64::MIN_POSITIVE)) as u64;
        self.bar.set_position(position);
    }

    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Progress<'_> {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A kind that takes ten times its guess is known for it, and does not make the others slow.
    #[test]
    fn what_is_left_is_told_by_cost() {
        // One second of the first kind, then nine of the second in three units.
        let mut forecast = Forecast::new(vec![(1.0, 0), (3.0, 1), (3.0, 1), (3.0, 1)], 2);
        let near = |a: [f64; 2], b: [f64; 2]| (0..2).all(|k| (a[k] - b[k]).abs() < 1e-12);
        assert!(near(forecast.seconds(), [0.0, 5.0]));
        // As it was guessed: the half of ten seconds on two threads.
        forecast.finish(0, Some(0.5));
        assert!(near(forecast.seconds(), [0.5, 4.5]));
        // By count there would be a half left, by guesses six seconds: it is near to thirty each.
        forecast.finish(1, Some(30.0));
        let all: f64 = (30.5 + 2.0 * 0.5) / (4.0 + 2.0);
        let own = (30.0 + 2.0 * all) / (3.0 + 2.0);
        assert!(near(
            forecast.seconds(),
            [3.0 * own + (0.5 + 2.0 * all) / 3.0, 6.0 * own]
        ));
        assert!(own > 8.0 && own < 10.0);
        // What was found says nothing of times, and is left no more.
        forecast.finish(2, None);
        forecast.finish(2, Some(1e9));
        forecast.finish(99, Some(1e9));
        assert!((forecast.seconds()[1] - 3.0 * own).abs() < 1e-12);
    }

    #[test]
    fn the_place_is_told_in_words() {
        let unit = |view, piece| SceneUnit { view, piece };
        let reference = |round| {
            Piece::Errors(Unit::Reference {
                round,
                integrals: 0..9,
            })
        };
        let cells = |cells| {
            Piece::Errors(Unit::Cells {
                cells,
                integrals: 0..9,
            })
        };
        let units = [
            unit(0, reference(0)),
            unit(0, cells(0..60)),
            unit(1, reference(0)),
            unit(1, reference(1)),
            unit(1, cells(0..16)),
            unit(1, cells(16..17)),
            unit(1, Piece::GalleryPicture(0)),
            unit(1, Piece::Exhibit),
        ];
        let told = |k| place(&units, k, &["hall", "box"], 60);
        assert_eq!(told(3), "scene 2 of 2: box, reference 2 of 2");
        assert_eq!(told(4), "scene 2 of 2: box, cells 1 to 16 of 60");
        assert_eq!(told(5), "scene 2 of 2: box, cell 17 of 60");
        assert_eq!(told(6), "scene 2 of 2: box, picture 1 of 1");
        assert_eq!(told(7), "scene 2 of 2: box, the scene's picture");
        assert_eq!(told(99), "");
        let said = [0.4, 89.4, 5000.0, 9000.0].map(waiting);
        assert_eq!(said, ["0 s left", "89 s left", "83 min left", "2.5 h left"]);
    }
}

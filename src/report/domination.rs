//! Which points of the peers our points dominate, from the rows of `results.csv` alone.

use super::csv_rows::{DominationRow, ResultRow, UndominatedRow};

/// The engine whose points are ours; all others are peers.
pub(super) const OURS: &str = "moreau";

/// Why no point of ours dominates a peer's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// No point of ours is as accurate, however long it takes.
    Accuracy,
    /// Some point of ours is as accurate, but every point of ours, at any accuracy, takes longer.
    Step,
    /// Some points of ours are as accurate and others are as fast, but none is both.
    Time,
    /// No point of ours was measured.
    None,
}

impl Cause {
    /// Every cause, in the order in which tables count them.
    pub const ALL: [Cause; 4] = [Cause::Accuracy, Cause::Step, Cause::Time, Cause::None];

    /// The word of `undominated.csv`.
    pub fn word(self) -> &'static str {
        match self {
            Cause::Accuracy => "accuracy",
            Cause::Step => "step",
            Cause::Time => "time",
            Cause::None => "none",
        }
    }
}

/// The peers' points that ours dominate, measure by measure.
///
/// A peer's point is dominated when at least one point of ours on the same scene, rung and
/// measure has
/// ```text
/// value ≤ its value   and   t (1 − s) ≤ t' (1 + s')                          (1)
/// ```
/// with time t and spread s of ours, t' and s' of the peer's; without repeats the spread is 0. Failed
/// points of peers are counted separately. Failed or unsolved points of ours dominate nothing.
/// Measures that no peer has are left out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Domination {
    /// In the order of the rows.
    pub pairs: Vec<DominationRow>,
    pub undominated: Vec<UndominatedRow>,
}

/// A point that was measured.
struct Point<'a> {
    row: &'a ResultRow,
    value: f64,
    time: f64,
    spread: f64,
}

impl<'a> Point<'a> {
    fn of(row: &'a ResultRow) -> Option<Point<'a>> {
        let time = row.seconds_per_simulated_second?;
        (row.value.is_finite() && time.is_finite()).then_some(Point {
            row,
            value: row.value,
            time,
            spread: row.spread.unwrap_or(0.0),
        })
    }

    fn as_fast(&self, other: &Point) -> bool {
        self.time * (1.0 - self.spread) <= other.time * (1.0 + other.spread)
    }
}

impl Domination {
    /// Counts over all rows of one file or of several.
    pub fn new(rows: &[ResultRow]) -> Domination {
        type Key<'a> = (&'a str, &'a str, &'a str);
        let mut groups: Vec<(Key, Vec<&ResultRow>)> = Vec::new();
        for row in rows {
            let key = (&*row.scene, &*row.rung, &*row.measure);
            // the rows of a scene stand together
            match groups.iter_mut().rev().find(|(known, _)| *known == key) {
                Some((_, group)) => group.push(row),
                None => groups.push((key, vec![row])),
            }
        }
        let mut domination = Domination::default();
        for (_, group) in groups {
            domination.add(&group);
        }
        domination
    }

    fn add(&mut self, group: &[&ResultRow]) {
        let (our_rows, peer_rows): (Vec<&ResultRow>, Vec<&ResultRow>) =
            group.iter().partition(|r| r.engine == OURS);
        let Some(first) = peer_rows.first() else {
            return;
        };
        let solved = |r: &&&ResultRow| r.verdict != "unsolved";
        let ours: Vec<Point> = our_rows
            .iter()
            .filter(solved)
            .filter_map(|r| Point::of(r))
            .collect();
        let peers: Vec<Point> = peer_rows.iter().filter_map(|r| Point::of(r)).collect();
        let mut pair = DominationRow {
            scene: first.scene.clone(),
            rung: first.rung.clone(),
            measure: first.measure.clone(),
            unit: first.unit.clone(),
            ours: ours.len(),
            ours_failed: our_rows.len() - ours.len(),
            peers: peers.len(),
            peers_failed: peer_rows.len() - peers.len(),
            dominated: 0,
            dominated_strictly: 0,
        };
        for peer in &peers {
            let accurate = |o: &&Point| o.value <= peer.value;
            if ours.iter().filter(accurate).any(|o| o.as_fast(peer)) {
                pair.dominated += 1;
            } else {
                self.undominated.push(undominated(peer, &ours));
            }
            let strictly = ours.iter().filter(accurate).any(|o| o.time <= peer.time);
            pair.dominated_strictly += usize::from(strictly);
        }
        self.pairs.push(pair);
    }

    /// Number of the peers' points, of those dominated by (1), and of those dominated by (1) with
    /// spreads of 0.
    pub fn counts(&self) -> (usize, usize, usize) {
        let sum = |of: fn(&DominationRow) -> usize| self.pairs.iter().map(of).sum();
        (
            sum(|p| p.peers),
            sum(|p| p.dominated),
            sum(|p| p.dominated_strictly),
        )
    }
}

/// The nearest point of ours: the fastest that is as accurate, else the most accurate that is as
/// fast, else the fastest.
fn undominated(peer: &Point, ours: &[Point]) -> UndominatedRow {
    let least = |key: fn(&Point) -> (f64, f64), fits: &dyn Fn(&Point) -> bool| {
        let order = |a: &(f64, f64), b: &(f64, f64)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1));
        let fitting = ours.iter().filter(|o| fits(o));
        fitting.min_by(|a, b| order(&key(a), &key(b)))
    };
    let accurate = least(|p| (p.time, p.value), &|o| o.value <= peer.value);
    let fast = least(|p| (p.value, p.time), &|o| o.as_fast(peer));
    let (cause, nearest) = match (accurate, fast) {
        (Some(o), Some(_)) => (Cause::Time, Some(o)),
        (Some(o), None) => (Cause::Step, Some(o)),
        (None, Some(o)) => (Cause::Accuracy, Some(o)),
        (None, None) => {
            let fastest = least(|p| (p.time, p.value), &|_| true);
            let cause = fastest.map_or(Cause::None, |_| Cause::Accuracy);
            (cause, fastest)
        }
    };
    let ratio = nearest.map(|o| match cause {
        // against the best of ours, at whatever time
        Cause::Accuracy => {
            let best = ours.iter().map(|o| o.value).fold(f64::INFINITY, f64::min);
            best / peer.value
        }
        _ => o.time / peer.time,
    });
    let of =
        |field: fn(&ResultRow) -> &String| nearest.map_or(String::new(), |o| field(o.row).clone());
    UndominatedRow {
        scene: peer.row.scene.clone(),
        rung: peer.row.rung.clone(),
        measure: peer.row.measure.clone(),
        unit: peer.row.unit.clone(),
        engine: peer.row.engine.clone(),
        setting: peer.row.setting.clone(),
        dt_s: peer.row.dt_s,
        value: peer.value,
        seconds_per_simulated_second: peer.time,
        spread: peer.row.spread,
        our_scheme: of(|r| &r.scheme),
        our_solver: of(|r| &r.solver),
        our_setting: of(|r| &r.setting),
        our_dt_s: nearest.map(|o| o.row.dt_s),
        our_value: nearest.map(|o| o.value),
        our_seconds_per_simulated_second: nearest.map(|o| o.time),
        cause: cause.word().to_owned(),
        // no value is a multiple of 0
        ratio: ratio.filter(|r| r.is_finite()),
    }
}

/// The rows of one scene that compare both sides: those of measures that a peer has, or all rows if no
/// peer has any.
pub fn shared(rows: &[ResultRow]) -> Vec<ResultRow> {
    let peers: Vec<&ResultRow> = rows.iter().filter(|r| r.engine != OURS).collect();
    let shown = |r: &&ResultRow| peers.is_empty() || peers.iter().any(|p| p.measure == r.measure);
    rows.iter().filter(shown).cloned().collect()
}

/// The Pareto front of points (time, value): those that no other beats in one without losing in
/// the other, by rising time; of equal ones the first.
pub fn front(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut sorted: Vec<(f64, f64)> = points
        .iter()
        .copied()
        .filter(|p| p.0.is_finite() && p.1.is_finite())
        .collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut front: Vec<(f64, f64)> = Vec::new();
    for point in sorted {
        if front.last().is_none_or(|last| point.1 < last.1) {
            front.push(point);
        }
    }
    front
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(engine: &str, value: f64, time: f64, spread: f64) -> ResultRow {
        ResultRow {
            scene: "s".to_owned(),
            rung: String::new(),
            engine: engine.to_owned(),
            scheme: String::new(),
            solver: String::new(),
            setting: format!("{engine} {value} {time}"),
            dt_s: 0.1,
            threads: 1,
            precision: "f64".to_owned(),
            measure: "m".to_owned(),
            value,
            unit: "1".to_owned(),
            reference: String::new(),
            seconds_per_simulated_second: Some(time),
            spread: (spread > 0.0).then_some(spread),
            verdict: String::new(),
            mode: String::new(),
        }
    }

    fn counts(rows: &[ResultRow]) -> (usize, usize, usize) {
        Domination::new(rows).counts()
    }

    #[test]
    fn a_tie_is_dominated_and_anything_better_is_not() {
        let ours = row("moreau", 1e-3, 2.0, 0.0);
        let count = |value, time| counts(&[ours.clone(), row("rapier", value, time, 0.0)]).1;
        assert_eq!(count(1e-3, 2.0), 1, "equal in both");
        assert_eq!(count(2e-3, 3.0), 1);
        assert_eq!(count(2e-3, 1.999), 0, "faster");
        assert_eq!(count(0.999e-3, 3.0), 0, "more accurate");
        // one of ours for each half of the peer's point does not make a whole
        let more = [
            row("moreau", 1e-3, 9.0, 0.0),
            row("moreau", 9.0, 1.0, 0.0),
            row("rapier", 2e-3, 2.0, 0.0),
        ];
        assert_eq!(counts(&more), (1, 0, 0));
    }

    #[test]
    fn zeros_are_values_and_failures_are_not() {
        let zero = [
            row("moreau", 0.0, 1.0, 0.0),
            row("rapier", 0.0, 1.5, 0.0),
            row("rapier", f64::NAN, 0.1, 0.0),
        ];
        let domination = Domination::new(&zero);
        assert_eq!(domination.counts(), (1, 1, 1));
        assert_eq!(domination.pairs[0].peers_failed, 1);
        // NaN of ours is as good as nothing, and so is a point that is marked unsolved
        let mut unsolved = row("moreau", 0.0, 0.5, 0.0);
        unsolved.verdict = "unsolved".to_owned();
        let rows = [
            row("moreau", f64::NAN, 0.1, 0.0),
            unsolved,
            row("rapier", 1.0, 1.0, 0.0),
        ];
        let domination = Domination::new(&rows);
        assert_eq!(domination.counts(), (1, 0, 0));
        assert_eq!(domination.pairs[0].ours_failed, 2);
        assert_eq!(domination.undominated[0].cause, "none");
        assert_eq!(domination.undominated[0].our_value, None);
        // one that was never timed is no point
        let mut untimed = row("rapier", 1.0, 1.0, 0.0);
        untimed.seconds_per_simulated_second = None;
        assert_eq!(counts(&[row("moreau", 0.0, 1.0, 0.0), untimed]), (0, 0, 0));
        assert_eq!(counts(&[]), (0, 0, 0));
    }

    #[test]
    fn times_within_the_spread_are_equal_and_are_counted_apart() {
        let rows = |spread| {
            [
                row("moreau", 1.0, 1.15, spread),
                row("rapier", 1.0, 1.0, 0.05),
            ]
        };
        // 1.15 (1 - 0.1) = 1.035 is within 1.05, 1.15 is not
        assert_eq!(counts(&rows(0.1)), (1, 1, 0));
        assert_eq!(counts(&rows(0.0)), (1, 0, 0));
        // values have none
        let value = [row("moreau", 1.01, 1.0, 0.5), row("rapier", 1.0, 1.0, 0.5)];
        assert_eq!(counts(&value), (1, 0, 0));
    }

    #[test]
    fn causes_tell_what_is_missing_and_the_nearest_point_of_ours() {
        let ours = [
            row("moreau", 1e-2, 1.0, 0.0),
            row("moreau", 1e-4, 4.0, 0.0),
            row("moreau", 1e-6, 16.0, 0.0),
        ];
        let found = |value, time| -> UndominatedRow {
            let mut rows = ours.to_vec();
            rows.push(row("rapier", value, time, 0.0));
            Domination::new(&rows).undominated.remove(0)
        };
        let time = found(1e-3, 2.0);
        assert_eq!((&*time.cause, time.our_value), ("time", Some(1e-4)));
        assert_eq!(time.ratio, Some(2.0));
        let step = found(1e-1, 0.25);
        assert_eq!((&*step.cause, step.our_value), ("step", Some(1e-2)));
        assert_eq!(step.ratio, Some(4.0));
        let accuracy = found(1e-7, 5.0);
        assert_eq!(
            (&*accuracy.cause, accuracy.our_value),
            ("accuracy", Some(1e-4))
        );
        assert!((accuracy.ratio.unwrap() - 10.0).abs() < 1e-9);
        // as fast as none of ours and as accurate as none
        let both = found(0.0, 0.5);
        assert_eq!((&*both.cause, both.our_value), ("accuracy", Some(1e-2)));
        assert_eq!(both.ratio, None);
    }

    #[test]
    fn pairs_are_kept_apart_and_those_without_a_peer_left_out() {
        let mut other = row("rapier", 1.0, 1.0, 0.0);
        other.rung = "2".to_owned();
        let mut alone = row("moreau", 1.0, 1.0, 0.0);
        alone.measure = "residual".to_owned();
        let rows = [
            row("moreau", 0.0, 0.1, 0.0),
            alone,
            row("rapier", 1.0, 1.0, 0.0),
            other,
            row("rapier-stiff", 2.0, 1.0, 0.0),
        ];
        let domination = Domination::new(&rows);
        let pairs: Vec<(&str, usize, usize)> = domination
            .pairs
            .iter()
            .map(|p| (&*p.rung, p.peers, p.dominated))
            .collect();
        assert_eq!(pairs, [("", 2, 2), ("2", 1, 0)]);
        assert_eq!(domination.counts(), (3, 2, 2));
    }

    #[test]
    fn what_ours_alone_shows_is_not_shared() {
        let mut residual = row("moreau", 1e-9, 1.0, 0.0);
        residual.measure = "residual".to_owned();
        let alone = [row("moreau", 1.0, 1.0, 0.0), residual];
        assert_eq!(shared(&alone), alone);
        let mut rows = alone.to_vec();
        rows.push(row("rapier", 1.0, 1.0, 0.0));
        let names: Vec<String> = shared(&rows).into_iter().map(|r| r.measure).collect();
        assert_eq!(names, ["m", "m"]);
    }

    #[test]
    fn the_front_falls_and_drops_what_is_beaten() {
        let points = [
            (2.0, 1.0),
            (1.0, 3.0),
            (1.0, 2.0),
            (3.0, 1.0),
            (4.0, f64::NAN),
            (5.0, 0.0),
        ];
        assert_eq!(front(&points), [(1.0, 2.0), (2.0, 1.0), (5.0, 0.0)]);
        assert!(front(&[]).is_empty());
    }
}

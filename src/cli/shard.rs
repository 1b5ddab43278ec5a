//! Which part of a sweep a process runs.

use crate::experiment::RunError;

/// Part `number` of `count`, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shard {
    pub number: usize,
    pub count: usize,
}

/// `--shard` as typed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Typed {
    /// `K/N`
    Part(Shard),
    /// `/N`: the number is that of the task in a job array.
    OfTask(usize),
}

/// Most parts: as many as a sweep has cases at most.
const MOST: usize = crate::scene::plan::MOST_CASES;

impl Typed {
    /// Reads `K/N` or `/N`.
    pub fn read(text: &str) -> Result<Typed, String> {
        let wrong = || {
            format!(
                "must be K/N, part K of N with 1 <= K <= N <= {MOST}, or /N in a job array, whose task \
                 number is K"
            )
        };
        let (number, count) = text.split_once('/').ok_or_else(wrong)?;
        let count: usize = count.parse().map_err(|_| wrong())?;
        if !(1..=MOST).contains(&count) {
            return Err(wrong());
        }
        match (number.is_empty(), number.parse()) {
            (true, _) => Ok(Typed::OfTask(count)),
            (false, Ok(number)) if (1..=count).contains(&number) => {
                Ok(Typed::Part(Shard { number, count }))
            }
            _ => Err(wrong()),
        }
    }
}

impl Shard {
    /// The whole sweep.
    pub const WHOLE: Shard = Shard {
        number: 1,
        count: 1,
    };

    /// The part that was typed, or that of the task of a job array. The second value is whether it is
    /// that of a job array.
    ///
    /// Slurm tells number, first number, step and count of its tasks: `SLURM_ARRAY_TASK_ID`, `_MIN`,
    /// `_STEP`, `_COUNT`. HyperQueue tells the number alone, from 0, in `HQ_TASK_ID`: the count must be typed.
    ///
    /// # Arguments
    /// - `variable`: the value of a variable of the environment.
    ///
    /// # Errors
    /// [`RunError::Unfit`] for a variable that is no number, a number that lies outside of the count, and
    /// `/N` outside of a job array.
    pub fn of(
        typed: Option<Typed>,
        variable: impl Fn(&str) -> Option<String>,
    ) -> Result<(Shard, bool), RunError> {
        if let Some(Typed::Part(shard)) = typed {
            return Ok((shard, false));
        }
        let whole = |name: &str| -> Result<Option<usize>, RunError> {
            let Some(text) = variable(name) else {
                return Ok(None);
            };
            let number = text.trim().parse().map_err(|_| {
                RunError::Unfit(format!("{name} = {text}: must be a whole number from 0"))
            })?;
            Ok(Some(number))
        };
        let count = match typed {
            Some(Typed::OfTask(count)) => Some(count),
            _ => None,
        };
        let slurm = whole("SLURM_ARRAY_TASK_ID")?;
        let queue = whole("HQ_TASK_ID")?;
        // a task of HyperQueue may run within a task of Slurm
        let (name, id, first, step, count) = match (slurm, queue) {
            (Some(id), None) => {
                let name = "SLURM_ARRAY_TASK_ID";
                let first = whole("SLURM_ARRAY_TASK_MIN")?.unwrap_or(0);
                let step = whole("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
                let own = whole("SLURM_ARRAY_TASK_COUNT")?;
                // a typed count is of tasks that are numbered from 1, also where a few of them run again
                match (count, own) {
                    (Some(count), _) => (name, id, 1, 1, count),
                    (None, Some(own)) => (name, id, first, step, own),
                    (None, None) => {
                        return Err(RunError::Unfit(format!(
                            "{name} = {id} without SLURM_ARRAY_TASK_COUNT: give --shard {id}/N"
                        )));
                    }
                }
            }
            (_, Some(id)) => match count {
                Some(count) => ("HQ_TASK_ID", id, 0, 1, count),
                None => {
                    return Err(RunError::Unfit(format!(
                        "HQ_TASK_ID = {id}, and HyperQueue does not tell how many tasks there are: give \
                         --shard /N for tasks 0 to N-1, or --shard 1/1 for a job without an array"
                    )));
                }
            },
            (None, None) => match count {
                None => return Ok((Shard::WHOLE, false)),
                Some(count) => {
                    return Err(RunError::Unfit(format!(
                        "--shard /{count}: neither SLURM_ARRAY_TASK_ID nor HQ_TASK_ID is set, so that this \
                         is no task of a job array; give --shard K/{count}"
                    )));
                }
            },
        };
        let place = id.checked_sub(first).filter(|past| past % step == 0);
        match place.map(|past| past / step + 1) {
            Some(number) if number <= count => Ok((Shard { number, count }, true)),
            _ => {
                let last = first.saturating_add((count.max(1) - 1).saturating_mul(step));
                Err(RunError::Unfit(format!(
                    "{name} = {id}: must be {first} to {last}, the numbers of {count} tasks; for a list \
                     of tasks such as --array=3,7 give --shard K/N"
                )))
            }
        }
    }

    /// Whether the case `number`, from 0, is of this part.
    pub fn has(self, number: usize) -> bool {
        number % self.count == self.number - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(typed: Option<&str>, set: &[(&str, &str)]) -> Result<(usize, usize), String> {
        let typed = typed.map(|text| Typed::read(text).unwrap());
        let variable = |name: &str| {
            let found = set.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        let found = Shard::of(typed, variable).map_err(|e| e.to_string())?;
        Ok((found.0.number, found.0.count))
    }

    #[test]
    fn parts_are_disjoint_and_whole() {
        for count in [1, 3, 7] {
            for case in 0..50 {
                let parts = (1..=count).map(|number| Shard { number, count });
                assert_eq!(parts.filter(|part| part.has(case)).count(), 1);
            }
        }
    }

    #[test]
    fn what_is_typed_comes_first() {
        let slurm = [
            ("SLURM_ARRAY_TASK_ID", "5"),
            ("SLURM_ARRAY_TASK_COUNT", "9"),
        ];
        assert_eq!(of(Some("2/3"), &slurm), Ok((2, 3)));
        assert_eq!(of(None, &[]), Ok((1, 1)));
        for wrong in ["0/3", "4/3", "1/0", "1", "a/b", "-1/3", "1/3/4", "/", "/0"] {
            assert!(Typed::read(wrong).is_err(), "{wrong}");
        }
    }

    /// `--array=1-9`, `--array=0-8` and `--array=10-26:2` are nine tasks each.
    #[test]
    fn slurm_arrays_count_from_their_first_task() {
        let task = |id, min, step| {
            let set = [
                ("SLURM_ARRAY_TASK_ID", id),
                ("SLURM_ARRAY_TASK_MIN", min),
                ("SLURM_ARRAY_TASK_STEP", step),
                ("SLURM_ARRAY_TASK_COUNT", "9"),
            ];
            of(None, &set)
        };
        assert_eq!(task("1", "1", "1"), Ok((1, 9)));
        assert_eq!(task("9", "1", "1"), Ok((9, 9)));
        assert_eq!(task("0", "0", "1"), Ok((1, 9)));
        assert_eq!(task("26", "10", "2"), Ok((9, 9)));
        for (id, min, step) in [("9", "0", "1"), ("0", "1", "1"), ("11", "10", "2")] {
            let error = task(id, min, step).unwrap_err();
            assert!(error.contains("give --shard K/N"), "{error}");
        }
        let error = task("x", "1", "1").unwrap_err();
        assert!(error.contains("SLURM_ARRAY_TASK_ID = x"), "{error}");
        let error = of(None, &[("SLURM_ARRAY_TASK_ID", "3")]).unwrap_err();
        assert!(error.contains("give --shard 3/N"), "{error}");
        let huge = [
            ("SLURM_ARRAY_TASK_ID", "1"),
            ("SLURM_ARRAY_TASK_COUNT", "18446744073709551615"),
            ("SLURM_ARRAY_TASK_STEP", "9999999999"),
        ];
        assert!(of(None, &huge).is_err());
        // a part of the array that is run again
        let again = [
            ("SLURM_ARRAY_TASK_ID", "3"),
            ("SLURM_ARRAY_TASK_MIN", "3"),
            ("SLURM_ARRAY_TASK_COUNT", "1"),
        ];
        assert_eq!(of(Some("/9"), &again), Ok((3, 9)));
    }

    #[test]
    fn tasks_of_hyperqueue_need_their_count() {
        let set = [("HQ_TASK_ID", "3")];
        assert_eq!(of(Some("/7"), &set), Ok((4, 7)));
        assert_eq!(of(Some("/7"), &[("HQ_TASK_ID", "0")]), Ok((1, 7)));
        let error = of(None, &set).unwrap_err();
        assert!(error.contains("give --shard /N"), "{error}");
        let error = of(Some("/7"), &[("HQ_TASK_ID", "7")]).unwrap_err();
        assert!(error.contains("must be 0 to 6"), "{error}");
        // within a task of Slurm
        let both = [set[0], ("SLURM_ARRAY_TASK_ID", "1")];
        assert_eq!(of(Some("/7"), &both), Ok((4, 7)));
        let error = of(Some("/7"), &[]).unwrap_err();
        assert!(error.contains("is no task of a job array"), "{error}");
    }
}

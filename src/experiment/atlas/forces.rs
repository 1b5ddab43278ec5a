use crate::contact::Vec3;
use crate::dynamics::record::StepRecord;

/// Contact forces of a run for each body, as the engine reported them.
pub(in crate::experiment) struct Forces {
    /// The number of each body of the scene in records.
    numbers: Vec<Option<u32>>,
    /// Sum of the normal impulses of the step \[N s\] and of their moments about the origin [N m s],
    /// by body number.
    now: Vec<Vec3>,
    /// The same sum over the late steps, those of the last tenth of the run.
    late: Vec<Vec3>,
    /// Largest magnitude of `now` in a step \[N s\].
    most: Vec<f64>,
    /// Least and largest magnitude of the force in a late step \[N\].
    range: Vec<[f64; 2]>,
    /// Duration of the late steps \[s\].
    time: f64,
    /// Sums of the magnitudes of all normal and of all tangential impulses of the late steps \[N s\].
    sizes: [f64; 2],
}

impl Forces {
    pub fn new(numbers: Vec<Option<u32>>) -> Forces {
        let last = numbers.iter().flatten().max();
        let count = last.map_or(0, |n| *n as usize + 1);
        Forces {
            numbers,
            now: vec![Vec3::zeros(); count],
            late: vec![Vec3::zeros(); count],
            most: vec![0.0; count],
            range: vec![[f64::INFINITY, 0.0]; count],
            time: 0.0,
            sizes: [0.0; 2],
        }
    }

    /// Adds the contacts of a step; `late` if it is in the last tenth of the run.
    pub fn add(&mut self, record: &StepRecord, late: bool) {
        self.now.fill(Vec3::zeros());
        for c in &record.contacts {
            let impulse = c.normal * c.impulse_n;
            let all = Vec3::new(impulse.x, impulse.y, c.position.perp(&impulse));
            for (body, sign) in c.bodies.into_iter().zip([-1.0, 1.0]) {
                if let Some(sum) = self.now.get_mut(body as usize) {
                    *sum += all * sign;
                }
            }
            if late {
                self.sizes[0] += c.impulse_n.abs();
                self.sizes[1] += c.impulse_t.abs();
            }
        }
        for impact in &record.impacts {
            for body in impact.bodies {
                if let Some(most) = self.most.get_mut(body as usize) {
                    *most = most.max(impact.impulse_n);
                }
            }
        }
        self.time += if late { record.dt } else { 0.0 };
        for (k, now) in self.now.iter().enumerate() {
            let size = now.xy().norm();
            // an engine that records impacts says an impulse there, whole
            if !record.accounted {
                self.most[k] = self.most[k].max(size);
            }
            if late {
                self.late[k] += now;
                let [least, most] = self.range[k];
                self.range[k] = [least.min(size / record.dt), most.max(size / record.dt)];
            }
        }
    }

    fn of<T>(&self, values: &[T], body: usize) -> Option<T>
    where
        T: Copy,
    {
        values.get(self.numbers[body]? as usize).copied()
    }

    /// Over the last tenth of the run: mean normal force \[N\] of all contacts on a body, and its
    /// moment \[N m\] about the origin. Friction is left out, because rapier reports it without a sign.
    pub fn wrench(&self, body: usize) -> Vec3 {
        let sum = self.of(&self.late, body);
        sum.map_or(Vec3::zeros(), |sum| sum / self.time)
    }

    /// Largest normal impulse \[N s\] of a body that one record of an impact reported; of a peer, its
    /// contacts together in one step.
    pub fn most(&self, body: usize) -> f64 {
        self.of(&self.most, body).unwrap_or(0.0)
    }

    /// Least and largest sum of the normal forces of a body's contacts \[N\], over the steps of the
    /// last tenth of the run.
    pub fn range(&self, body: usize) -> [f64; 2] {
        self.of(&self.range, body).unwrap_or([0.0; 2])
    }

    /// Ratio of the tangential to the normal impulses of all contacts in the last tenth of the run.
    pub fn friction(&self) -> f64 {
        self.sizes[1] / self.sizes[0]
    }
}

//! Inputs of which the commands come late, for a run that stops at each of their jumps.

use super::Inputs;

/// Jumps this close together [s] are one.
const SAME_S: f64 = 1e-9;

/// Commands and oil temperatures, held from each time until the next.
pub(super) struct Late {
    time: Vec<f64>,
    command: Vec<[f64; 2]>,
    oil_temperature_degc: Vec<f64>,
    load_kg: f64,
}

impl Late {
    /// `inputs` with free and main command later by `delays` [s]: until then the first one holds.
    pub fn new(inputs: &Inputs, delays: [f64; 2]) -> Self {
        let start = inputs.time[0];
        // A delayed jump that falls on the clock is at the clock's own time, to the bit.
        let on_clock = |t: f64| {
            let k = inputs.time.partition_point(|&from| from < t - SAME_S);
            inputs.time.get(k).copied().filter(|from| (from - t).abs() < SAME_S).unwrap_or(t)
        };
        let later = |delay: f64| inputs.time.iter().map(move |t| t + delay);
        let mut time: Vec<f64> = later(0.0).chain(later(delays[0])).chain(later(delays[1])).map(on_clock).collect();
        time.sort_by(f64::total_cmp);
        // Nearer ones are the same jump, rounded.
        time.dedup_by(|later, earlier| *later - *earlier < SAME_S);
        let held = |t: f64, delay: f64| inputs.time.partition_point(|&from| from + delay < t + SAME_S).max(1) - 1;
        Late {
            command: time.iter().map(|&t| [0, 1].map(|k| inputs.command[held(t, delays[k])][k])).collect(),
            oil_temperature_degc: time.iter().map(|&t| inputs.oil_temperature_degc[held(t.max(start), 0.0)]).collect(),
            load_kg: inputs.load_kg,
            time,
        }
    }

    pub fn inputs(&self) -> Inputs<'_> {
        Inputs {
            time: &self.time,
            command: &self.command,
            oil_temperature_degc: &self.oil_temperature_degc,
            load_kg: self.load_kg,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_command_comes_later_by_its_own_delay_and_the_temperature_at_once() {
        let inputs = Inputs {
            time: &[0.0, 1.0, 2.0],
            command: &[[0.0, 0.5], [1.0, 0.6], [2.0, 0.7]],
            oil_temperature_degc: &[20.0, 21.0, 22.0],
            load_kg: 5.0,
        };
        let late = Late::new(&inputs, [0.25, 0.0]);
        let late = late.inputs();
        let at = |t: f64| late.time.iter().rposition(|&from| from <= t).unwrap();
        for (t, command, temperature) in
            [(0.9, [0.0, 0.5], 20.0), (1.1, [0.0, 0.6], 21.0), (1.3, [1.0, 0.6], 21.0), (2.3, [2.0, 0.7], 22.0)]
        {
            assert_eq!(late.command[at(t)], command, "{t}");
            assert_eq!(late.oil_temperature_degc[at(t)], temperature, "{t}");
        }
        assert!(late.time.windows(2).all(|pair| pair[0] < pair[1]));
    }
}

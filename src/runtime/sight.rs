//! What conditions look at, by probes: which probes serve which inputs, and the samples they give.

use super::probe::{Observed, Probes};
use crate::model::RunState;
use crate::model::monitor::{Counter, ValuePart};
use crate::monitor::{InputSample, MonitorInput, state_value};
use crate::time::Time;
use std::sync::Arc;

/// Inputs of conditions and the probes that serve them; cheap to clone.
#[derive(Clone)]
pub struct Sight {
    wanted: Arc<[Observed]>,
    /// The inputs that each probe serves.
    served: Arc<[Vec<(usize, SightOf)>]>,
}

/// What an input takes from its probe.
enum SightOf {
    Number(Vec<ValuePart>),
    State,
    Faulted,
    Counter(Counter),
}

impl Sight {
    /// What serves these inputs.
    pub fn of(inputs: &[MonitorInput]) -> Self {
        let mut wanted: Vec<Observed> = Vec::new();
        let mut served: Vec<Vec<(usize, SightOf)>> = Vec::new();
        for (i, input) in inputs.iter().enumerate() {
            let (of, what) = match input {
                MonitorInput::Port(signal) => (Observed::Port(signal.member), SightOf::Number(signal.path.clone())),
                MonitorInput::State(component) => (Observed::Component(*component), SightOf::State),
                MonitorInput::Faulted(component) => (Observed::Component(*component), SightOf::Faulted),
                MonitorInput::Activity { activity, counter } => {
                    (Observed::Activity(*activity), SightOf::Counter(*counter))
                }
            };
            let place = wanted.iter().position(|w| *w == of).unwrap_or_else(|| {
                wanted.push(of);
                served.push(Vec::new());
                wanted.len() - 1
            });
            served[place].push((i, what));
        }
        Self { wanted: wanted.into(), served: served.into() }
    }

    /// What is to be probed.
    pub fn wanted(&self) -> &Arc<[Observed]> {
        &self.wanted
    }

    /// Takes the newest samples: of each input that something serves now; the others are absent.
    pub fn look(&self, probes: &mut Probes, now: Time, samples: &mut [InputSample]) {
        for sample in samples.iter_mut() {
            sample.present = false;
        }
        for (place, mut seen) in probes.each() {
            let written = seen.written();
            for (input, what) in &self.served[place] {
                let sample = match what {
                    SightOf::Number(path) => {
                        written.map(|(at, writes)| (seen.number(path).unwrap_or(f64::NAN), at, writes))
                    }
                    SightOf::State => seen.state().map(|state| (state_value(state), now, 0)),
                    SightOf::Faulted => {
                        seen.state().map(|state| (f64::from(u8::from(state == RunState::Faulted)), now, 0))
                    }
                    SightOf::Counter(counter) => seen.counter(*counter).map(|value| (value, now, 0)),
                };
                if let Some((value, at, writes)) = sample {
                    samples[*input] = InputSample { value, at, writes, present: true };
                }
            }
        }
    }
}

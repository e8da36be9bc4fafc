//! From a signal to events.

use crate::model::EventName;
use crate::runtime::{Builder, Component, Context, EventOut, In, Out, Prop};

/// Raises an event when a signal rises above a threshold, and another when it falls below a lower one.
pub struct Threshold {
    u: In<f64>,
    above: Out<bool>,
    events: EventOut,
    rise: Prop<f64>,
    fall: Prop<f64>,
    rise_event: Event,
    fall_event: Event,
    is_above: bool,
}

/// A property that is the name of an event, made into one when it changes: making a name takes a lock.
struct Event {
    text: Prop<String>,
    name: Option<EventName>,
    read: bool,
}

impl Event {
    fn new(text: Prop<String>) -> Self {
        Self { text, name: None, read: false }
    }

    fn refresh(&mut self) -> Result<(), String> {
        if self.text.changed() || !self.read {
            self.read = true;
            let text = self.text.get_ref();
            self.name = match text.as_str() {
                "" => None,
                text => Some(EventName::new(text).map_err(|error| error.to_string())?),
            };
        }
        Ok(())
    }
}

impl Component for Threshold {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "Raises an event when a signal rises above `rise`, and another when it falls below `fall`. Between the two \
             nothing happens, so noise raises no flood of events. At the start the signal counts as below.",
        );
        Self {
            u: b.doc("The signal.").input("u"),
            above: b.doc("Whether the signal is above, in this sense.").output("above"),
            events: b.doc("The events.").event_output("events"),
            rise: b.doc("Above this the signal is above.").property("rise", 1.0),
            fall: b.doc("Below this it is below again; above `rise` it counts as `rise`.").property("fall", 0.0),
            rise_event: Event::new(
                b.doc("Raised on rising; empty: none.").raises().property("rise_event", String::new()),
            ),
            fall_event: Event::new(
                b.doc("Raised on falling; empty: none.").raises().property("fall_event", String::new()),
            ),
            is_above: false,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        if cx.is_first() {
            self.is_above = false;
        }
        for event in [&mut self.rise_event, &mut self.fall_event] {
            if let Err(error) = event.refresh() {
                cx.fault(error);
                return;
            }
        }
        let Some(u) = self.u.get() else { return };
        let rise = self.rise.get();
        let fall = self.fall.get().min(rise);
        let was = self.is_above;
        self.is_above = if was { u >= fall } else { u > rise };
        if self.is_above != was {
            let event = if self.is_above { self.rise_event.name } else { self.fall_event.name };
            if let Some(event) = event {
                self.events.raise(event);
            }
        }
        self.above.write(self.is_above);
    }
}

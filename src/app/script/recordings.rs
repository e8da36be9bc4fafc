//! `sample{ every = 0.01, signals = { e = "Arm.error" } }`: series that are recorded while the script goes on.

use super::options::OptionFields;
use super::{SharedHost, error, seen, session};
use crate::limits;
use crate::model::Ident;
use crate::model::finding::{count, did_you_mean};
use crate::model::monitor::PortSignal;
use crate::session::recording::{Recording, RecordingRoom, SeriesFigures};
use mlua::{Lua, Table, UserData, UserDataMethods, Value as LuaValue};
use std::collections::BTreeMap;
use std::time::Duration;

/// What a script has recorded under one name.
#[derive(Debug, Clone)]
pub struct ScriptSample {
    /// Its name, of letters, digits and `_`.
    pub name: String,
    /// The series.
    pub recording: Recording,
    /// What the script calls the signals, and where each is among those of the recording.
    called: BTreeMap<String, usize>,
}

/// All that a script has recorded.
pub(super) struct Recordings {
    all: Vec<ScriptSample>,
    room: RecordingRoom,
}

impl Default for Recordings {
    fn default() -> Self {
        Self { all: Vec::new(), room: RecordingRoom::new(limits::RECORDED_VALUES) }
    }
}

impl Recordings {
    /// Ends all: what they look at goes.
    pub(super) fn stop(&self) {
        self.all.iter().for_each(|sample| sample.recording.stop());
    }

    pub(super) fn into_all(self) -> Vec<ScriptSample> {
        self.stop();
        self.all
    }
}

/// Begins a recording.
pub(super) fn sample(host: &SharedHost, table: Table) -> mlua::Result<ScriptSample> {
    let fields = OptionFields::of("sample", Some(table), &["every", "signals", "name"])?;
    let every = fields.needed("every", fields.number("every")?, "how often to look, in seconds, such as 0.01")?;
    let shortest = limits::SHORTEST_PERIOD.as_secs_f64();
    if !(shortest..=1e6).contains(&every) {
        return Err(error(format!("`sample`: every {every} s: a number of seconds from {shortest} to 1000000")));
    }
    let example = "what to look at, such as { force = \"Arm.force\" }";
    let signals = fields.needed("signals", fields.table("signals")?, example)?;
    let (called, signals) = written(host, signals)?;
    let name = {
        let recordings = &host.borrow().recordings;
        if recordings.all.len() >= limits::RECORDINGS {
            return Err(error(format!("a script has at most {}", count(limits::RECORDINGS, "recording"))));
        }
        let name = fields.text("name")?.unwrap_or_else(|| format!("sample{}", recordings.all.len() + 1));
        if Ident::new(&name).is_err() {
            return Err(error(format!("`sample`: `{name}` is no name: it is made of letters, digits and `_`")));
        }
        if recordings.all.iter().any(|other| other.name == name) {
            return Err(error(format!("there is a recording `{name}` already: give this one another name")));
        }
        name
    };
    let (session, room) = (session(host)?, host.borrow().recordings.room.clone());
    let recording = session.record(signals, Duration::from_secs_f64(every), &room);
    let recording = recording.map_err(|why| error(format!("`sample`: {why}")))?;
    let sample = ScriptSample { name, recording, called };
    host.borrow_mut().recordings.all.push(sample.clone());
    Ok(sample)
}

/// The signals of a table, each once, and by what names the script calls them. A list calls each as it is written.
fn written(host: &SharedHost, table: &Table) -> mlua::Result<(BTreeMap<String, usize>, Vec<PortSignal>)> {
    let mut texts = BTreeMap::new();
    for pair in table.pairs::<LuaValue, LuaValue>() {
        let (key, value) = pair?;
        let LuaValue::String(text) = &value else {
            let is = value.type_name();
            return Err(error(format!("`sample`: a signal is a text such as \"Arm.force[0]\", and this is a {is}")));
        };
        let text = text.to_string_lossy();
        let called = if key.is_integer() { text.clone() } else { key.to_string()? };
        texts.insert(called, text);
    }
    if texts.is_empty() {
        return Err(error("`sample` needs signals: signals = { force = \"Arm.force\" }"));
    }
    let (mut called, mut signals) = (BTreeMap::new(), Vec::<PortSignal>::new());
    for (name, text) in texts {
        let found = seen::find(host, &text)?;
        let number = found.signal.is_number(&found.ty);
        number.map_err(|wrong| error(format!("`sample`: {}: {}", wrong.message, wrong.help)))?;
        let place = signals.iter().position(|known| *known == found.signal).unwrap_or_else(|| {
            signals.push(found.signal);
            signals.len() - 1
        });
        called.insert(name, place);
    }
    if signals.len() > limits::RECORDED_SIGNALS {
        return Err(error(format!("a recording has at most {}", count(limits::RECORDED_SIGNALS, "signal"))));
    }
    Ok((called, signals))
}

impl ScriptSample {
    /// The recording that something is asked of, as `call` has it.
    fn asked(of: &LuaValue, call: &str) -> mlua::Result<Self> {
        let sample = of.as_userdata().and_then(|of| of.borrow::<Self>().ok());
        sample.map(|sample| sample.clone()).ok_or_else(|| {
            error(format!("what is asked of a recording is asked with a colon: `s:{call}`, where `s = sample{{ … }}`"))
        })
    }

    /// The same of one of its signals.
    fn asked_of(of: &LuaValue, signal: &LuaValue, name: &str) -> mlua::Result<(Self, String)> {
        let sample = Self::asked(of, &format!("{name}(\"SIGNAL\")"))?;
        match signal {
            LuaValue::String(signal) => Ok((sample, signal.to_string_lossy())),
            _ => Err(error(format!("`{name}` of a recording is asked of one of its signals: `s:{name}(\"SIGNAL\")`"))),
        }
    }

    /// What to say of it when it could not keep everything.
    pub fn note(&self) -> Option<String> {
        let table = self.recording.table();
        let full = table.full?.as_secs_f64();
        Some(format!(
            "the recording `{}` kept {} of {}: from {full} s on there was no room, since all recordings of a script keep {} values \
             together; figures are of all",
            self.name,
            table.times.len(),
            count(table.looks, "look"),
            limits::RECORDED_VALUES
        ))
    }

    fn place(&self, signal: &str) -> mlua::Result<usize> {
        self.called.get(signal).copied().ok_or_else(|| {
            let help = did_you_mean(signal, "signals", self.called.keys().map(String::as_str));
            error(format!("the recording `{}` has no signal `{signal}`: {help}", self.name))
        })
    }

    /// Of a signal's values so far, of which there must be one.
    fn figures(&self, signal: &str) -> mlua::Result<SeriesFigures> {
        let place = self.place(signal)?;
        let figures = self.recording.figures(place);
        if figures.count == 0 {
            let port = self.recording.signals()[place].member;
            let every = self.recording.every().as_secs_f64();
            return Err(error(format!(
                "the recording `{}` has no value of `{signal}` yet: nothing came through `{port}`, looked at every {every} s",
                self.name
            )));
        }
        Ok(figures)
    }

    fn values(&self, lua: &Lua, signal: &str) -> mlua::Result<Table> {
        let place = self.place(signal)?;
        let table = self.recording.table();
        if let Some(note) = self.note() {
            return Err(error(format!("{note}: record with a larger `every`, or fewer signals")));
        }
        let width = self.recording.signals().len();
        lua.create_sequence_from(table.values.iter().skip(place).step_by(width).copied())
    }
}

impl UserData for ScriptSample {
    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        type Of = (LuaValue, LuaValue);
        methods.add_function("stop", |_, of: LuaValue| {
            Self::asked(&of, "stop()")?.recording.stop();
            Ok(())
        });
        let figure = |methods: &mut M, name: &'static str, of: fn(&SeriesFigures) -> f64| {
            methods.add_function(name, move |_, (sample, signal): Of| {
                let (sample, signal) = Self::asked_of(&sample, &signal, name)?;
                Ok(of(&sample.figures(&signal)?))
            });
        };
        figure(methods, "rms", SeriesFigures::rms);
        figure(methods, "mean", SeriesFigures::mean);
        figure(methods, "max", |of| of.max);
        figure(methods, "min", |of| of.min);
        figure(methods, "last", |of| of.last);
        methods.add_function("count", |_, (sample, signal): Of| {
            let (sample, signal) = Self::asked_of(&sample, &signal, "count")?;
            Ok(sample.recording.figures(sample.place(&signal)?).count)
        });
        methods.add_function("values", |lua, (sample, signal): Of| {
            let (sample, signal) = Self::asked_of(&sample, &signal, "values")?;
            sample.values(lua, &signal)
        });
        methods.add_function("times", |lua, of: LuaValue| {
            let sample = Self::asked(&of, "times()")?;
            lua.create_sequence_from(sample.recording.table().times.into_iter().map(|at| at.as_secs_f64()))
        });
        methods.add_meta_method("__index", |_, _, name: String| -> mlua::Result<LuaValue> {
            let help = did_you_mean(&name, "methods", METHODS);
            Err(error(format!("a recording has no `{name}`: {help}")))
        });
    }
}

/// What can be asked of a recording.
const METHODS: [&str; 9] = ["stop", "rms", "mean", "max", "min", "last", "count", "values", "times"];

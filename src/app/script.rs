//! Scripts: a bring-up, what is done with it, and what must be true meanwhile, as a Lua program (`davit run`).
//!
//! A script is one participant of the clock: in simulated time nothing moves while it computes, so what it asserts is
//! what it sees. Whatever happens, the deployment it brought up is taken down before the script's end is reported.

mod arguments;
mod deploying;
mod failure;
mod faults;
mod figures;
mod inject;
mod interrupt;
mod looks;
mod options;
mod parameters;
mod recordings;
mod sandbox;
mod scene;
mod seen;
mod values;
mod waits;

use super::{Extensions, Refused};
use crate::check::Far;
use crate::diagnostics::{Language, SourceMap};
use crate::functions::{self, message_within};
use crate::lang::{self, LoadOptions, Sources, UnknownName};
use crate::limits;
use crate::model::codes::LUA_UNDEFINED;
use crate::model::finding::{and_also, did_you_mean};
use crate::model::{Ask, ConfigId, Finding, Ident};
use crate::session::tap::LogSink;
use crate::session::{Ended, NO_FORWARD, NotNamed, Session, Unanswered, recovery};
use crate::time::{Clock, Time};
pub use arguments::functions;
use failure::IsRefused;
pub use failure::ScriptFailure;
pub use figures::{Figure, beside, digits};
pub use interrupt::Interrupt;
use mlua::{FromLua, Lua, MultiValue, Table, Value as LuaValue};
use options::{OptionFields, force};
pub use recordings::ScriptSample;
pub use scene::ScriptScene;
use std::any::Any;
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// What a script runs on.
pub struct ScriptOptions {
    /// The clock; the calling thread is made a participant.
    pub clock: Clock,
    /// Component libraries and platforms.
    pub extensions: Extensions,
    /// Its parameters, and those of the deployments it loads (`--set`).
    pub load: LoadOptions,
    /// The platform they run on, instead of the one they name.
    pub platform: Option<Ident>,
    /// Hears everything that happens.
    pub observer: Option<Arc<dyn LogSink>>,
    /// Where `say` goes.
    pub say: Box<dyn Fn(&str)>,
    /// By what somebody outside stops it.
    pub interrupt: Interrupt,
    /// Makes a deployment on the real clock, of that file, known under its name, until it is down; or says why that cannot be.
    pub door: Option<Door>,
    /// Begins to tell how far the check of a deployment is; what it answers is dropped at the end of it.
    pub checking: Option<CheckTeller>,
}

/// See [`ScriptOptions::checking`].
pub type CheckTeller = Box<dyn Fn() -> Box<dyn Fn(Far) + Sync>>;

/// See [`ScriptOptions::door`].
pub type Door = Box<dyn Fn(&Arc<Session>, &Path) -> Result<Box<dyn Any>, String>>;

/// How a script ended.
#[derive(Debug)]
pub struct ScriptEnd {
    /// What went wrong, if something did.
    pub failure: Option<ScriptFailure>,
    /// How its deployment ended, if it had one.
    pub ended: Option<Ended>,
    /// What was there when it failed, where something was deployed.
    pub scene: Option<ScriptScene>,
    /// What it has measured.
    pub figures: Vec<Figure>,
    /// What it has recorded.
    pub samples: Vec<ScriptSample>,
}

struct ScriptHost {
    options: ScriptOptions,
    folder: PathBuf,
    session: Option<Arc<Session>>,
    /// By what it is reached from outside.
    door: Option<Box<dyn Any>>,
    /// What goes wrong, and where it does.
    faults: faults::ScriptFaults,
    /// Answers and events after this one are news for `wait_answer`, but for those that one has waited for already.
    mark: u64,
    taken: Vec<u64>,
    refused: Option<(PathBuf, Box<Refused>)>,
    ended: Option<Ended>,
    looks: seen::ScriptLooks,
    recordings: recordings::Recordings,
    figures: Vec<Figure>,
    injector: Option<inject::Injector>,
    parameters: parameters::ScriptParameters,
    /// A parameter was given that nobody reads.
    unread: Option<String>,
    /// Faults that were to be injected and were not.
    not_injected: Vec<String>,
    /// What was there when the first figure was missed.
    scene: Option<ScriptScene>,
}

impl ScriptHost {
    /// What was up is down, and nobody looks at it any more.
    fn down(&mut self) {
        self.recordings.stop();
        self.not_injected.extend(self.injector.take().map(inject::Injector::end).unwrap_or_default());
        self.looks = seen::ScriptLooks::default();
        self.session = None;
        self.door = None;
        self.faults.down();
    }
}

type SharedHost = Rc<RefCell<ScriptHost>>;

/// How long reading the platform, or a recovery, may take, in time of the script's clock.
const RECOVERY: Duration = limits::SCRIPT_RECOVERY;

/// Runs the script at `path`.
pub fn run(path: &Path, options: ScriptOptions) -> ScriptEnd {
    let text = match Sources::Disk.read(path) {
        Ok(text) => text,
        Err(finding) => {
            let failure = Some(ScriptFailure::Unreadable(finding));
            return ScriptEnd { failure, ended: None, scene: None, figures: Vec::new(), samples: Vec::new() };
        }
    };
    let clock = options.clock.clone();
    let _participant = clock.enter();
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let parameters = parameters::ScriptParameters::new(&options.load.set, &text);
    let host = Rc::new(RefCell::new(ScriptHost {
        options,
        folder,
        session: None,
        door: None,
        faults: faults::ScriptFaults::default(),
        mark: 0,
        taken: Vec::new(),
        refused: None,
        ended: None,
        looks: seen::ScriptLooks::default(),
        recordings: recordings::Recordings::default(),
        figures: Vec::new(),
        injector: None,
        parameters,
        unread: None,
        not_injected: Vec::new(),
        scene: None,
    }));
    let driven = catch_unwind(AssertUnwindSafe(|| execute(path, &text, &host)));
    // What panicked may have it borrowed, and its Lua state may live on: the session is taken out either way.
    let failure = match driven {
        Ok(driven) => driven.err(),
        Err(panic) => {
            let session = host.try_borrow().ok().and_then(|host| host.session.clone());
            if let Some(session) = session {
                let _ = session.guarded(|| session.take_down(false));
            }
            resume_unwind(panic);
        }
    };
    // Where it was stopped from outside, where it was then says nothing.
    let scene = failure.is_some().then(|| interrupt(&host).check().ok().and_then(|()| scene::now(&host))).flatten();
    let mut host = Rc::try_unwrap(host).ok().expect("the Lua state is gone").into_inner();
    let missed = figures::failure(&host.figures).map(|message| ScriptFailure::Missed { message });
    let scene = if failure.is_some() { scene } else { host.scene.take() };
    if let Some(session) = host.session.take() {
        host.ended = Some(session.take_down(false));
        host.down();
    }
    let not_injected = host.not_injected.drain(..).next();
    let not_injected = not_injected.map(|message| ScriptFailure::Lua { message, syntax: false });
    let unread = host.unread.take().or_else(|| host.parameters.first_unread().filter(|_| failure.is_none()));
    let unread = unread.map(|message| ScriptFailure::Unread { message });
    let failure = unread.or(failure).or(not_injected).or(missed);
    ScriptEnd { failure, ended: host.ended, scene, figures: host.figures, samples: host.recordings.into_all() }
}

fn execute(path: &Path, text: &str, host: &SharedHost) -> Result<(), ScriptFailure> {
    // It fails by the refusal of a deployment only where it has let that through: one that it caught is its own affair.
    let failed = |error: mlua::Error| match error.chain().any(|error| error.is::<IsRefused>()) {
        true if host.borrow().refused.is_some() => {
            let (path, refused) = host.borrow_mut().refused.take().expect("looked at just now");
            ScriptFailure::Refused { path, refused }
        }
        _ => ScriptFailure::Lua {
            syntax: matches!(error, mlua::Error::SyntaxError { .. }),
            message: message_within(&error, limits::SCRIPT_MEMORY),
        },
    };
    if let Some(again) = lang::key_again(text) {
        let message = format!("{}:{again}", path.display());
        return Err(ScriptFailure::Lua { message, syntax: true });
    }
    let (lua, guards) = sandbox::state().map_err(failed)?;
    install(&lua, host).map_err(failed)?;
    guards.budget.count.interrupted_by(interrupt(host).asked());
    let chunk = lua.load(functions::without_hash_bang(text)).set_name(format!("@{}", path.display()));
    let script = chunk.set_mode(mlua::chunk::ChunkMode::Text).into_function().map_err(failed)?;
    no_unknown_names(path, text, &lua)?;
    guards.budget.spend(limits::SCRIPT_INSTRUCTIONS, || script.call::<()>(())).map_err(failed)
}

/// A misspelt name is told before anything is brought up, and not in the middle of it.
fn no_unknown_names(path: &Path, text: &str, lua: &Lua) -> Result<(), ScriptFailure> {
    let globals = lua.globals();
    let known = |name: &str| globals.raw_get::<LuaValue>(name).is_ok_and(|value| !value.is_nil());
    let unknown = lang::unknown_names(functions::without_hash_bang(text), known);
    if unknown.is_empty() {
        return Ok(());
    }
    let mut sources = SourceMap::new();
    let file = sources.add_file(path.display().to_string(), text, Language::Lua);
    let finding = |one: UnknownName| {
        let at = sources.exact(file, one.line, one.column, one.length);
        Finding::error(LUA_UNDEFINED, format!("`{}` is not defined", one.name))
            .at(at)
            .help(meant(&one.name, one.near.as_deref()))
            .labelled("here")
    };
    let findings = unknown.into_iter().map(finding).collect();
    Err(ScriptFailure::Unknown { findings, sources: Box::new(sources) })
}

/// What may be meant by a name that there is not.
fn meant(name: &str, near: Option<&str>) -> String {
    if let Some(near) = near {
        return format!("did you mean `{near}`?");
    }
    if let Some(why) = lang::why_closed(name) {
        return format!("{why}: what a script needs is given to it, `param(\"NAME\", DEFAULT)`");
    }
    // What Lua has for it elsewhere is near nothing here.
    match name {
        "print" => "did you mean `say`?".to_owned(),
        "sleep" => "did you mean `wait`?".to_owned(),
        _ => and_also(
            &did_you_mean(name, "functions", arguments::functions()),
            &format!("what is a name of something stands in quotes: `\"{name}\"`"),
        ),
    }
}

fn install(lua: &Lua, host: &SharedHost) -> mlua::Result<()> {
    let globals = lua.globals();
    macro_rules! function {
        ($name:literal, $types:ty, |$h:ident, $lua:ident, $args:pat_param| $body:expr) => {{
            let host = host.clone();
            globals.set(
                $name,
                lua.create_function(move |$lua, given: MultiValue| {
                    let $args: $types = arguments::taken($name, given, $lua)?;
                    let $h = &host;
                    $body
                })?,
            )?;
        }};
    }
    function!("deploy", (String, Option<Table>), |h, lua, (file, options)| deploying::deploy(h, &file, options));
    function!("raise", (String, Option<Table>), |h, lua, (event, options)| {
        raise(h, &event, OptionFields::of("raise", options, &["to"])?.names("to")?)
    });
    function!("apply", (String, Option<Table>), |h, lua, (id, options)| {
        request(h, Some(&id), Ask::Apply, force("apply", options)?)
    });
    function!("undo", (Option<String>, Option<Table>), |h, lua, (id, options)| {
        request(h, id.as_deref(), Ask::UndoOf, force("undo", options)?)
    });
    function!("set", (String, LuaValue, Option<Table>), |h, lua, (member, value, options)| {
        let (session, value) = (session(h)?, values::from_lua(&value)?);
        let options = OptionFields::of("set", options, &["force", "within"])?;
        let (force, within) = (options.flag("force")?, options.number("within")?);
        listen_anew(h, &session);
        let set = session.set(LINE, &member, &value, force);
        let request = set.map_err(|why| error(format!("{}: {}", why.message, why.help)))?;
        within.map_or(Ok(()), |within| waits::wait_done(h, request, within))
    });
    function!("commit", Option<Table>, |h, lua, options| {
        let session = session(h)?;
        listen_anew(h, &session);
        session.request_on(LINE, Ask::Commit { force: force("commit", options)? }, "operator", false);
        Ok(())
    });
    function!("drift", (), |h, lua, ()| {
        let drift = session(h)?.drift(RECOVERY).ok_or_else(|| error("the platform could not be read"))?;
        values::to_lua(lua, &drift)
    });
    function!("recover", String, |h, lua, how| recover(h, &how));
    function!("wait", LuaValue, |h, lua, seconds| {
        // Numbers of either kind, and texts that are numbers, as everywhere in Lua.
        let seconds = f64::from_lua(seconds, lua).map_err(|_| {
            error("`wait` takes seconds: `wait(0.5)`; what waits for an answer is `wait_answer(\"ID.ok\", 5)`, for a state `wait_state(\"NAME\", 5)`")
        })?;
        let (clock, until, interrupt) = (clock(h), deadline(h, seconds)?, interrupt(h));
        interrupt.sleep(&clock, until)
    });
    function!("wait_state", (String, f64), |h, lua, (state, seconds)| waits::wait_state(h, &state, seconds));
    function!("wait_answer", (String, f64), |h, lua, (event, seconds)| waits::wait_answer(h, &event, seconds));
    function!("param", (String, LuaValue), |h, lua, (name, default)| parameters::param(h, lua, &name, default));
    function!("signal", String, |h, lua, text| seen::signal(h, lua, &text));
    function!("sample", Table, |h, lua, table| recordings::sample(h, table));
    function!("expect", Table, |h, lua, table| figures::add(h, lua, table, true));
    function!("figure", Table, |h, lua, table| figures::add(h, lua, table, false));
    function!("assert_running", String, |h, lua, name| looks::assert_state(h, &name, "running"));
    function!("assert_state", (String, String), |h, lua, (name, state)| looks::assert_state(h, &name, &state));
    function!("state", String, |h, lua, name| Ok(looks::component_state(h, &name)?.map(|s| s.to_string())));
    function!("property", String, |h, lua, name| looks::property(h, lua, &name));
    function!("port", String, |h, lua, name| looks::port(h, lua, &name));
    function!("system", (), |h, lua, ()| values::to_lua(lua, &looks::system(h)?));
    function!("stack", (), |h, lua, ()| {
        let stack = session(h)?.status().stack.ok_or_else(|| error(Unanswered.to_string()))?;
        values::to_lua(lua, &stack)
    });
    function!("active", (), |h, lua, ()| lua.create_sequence_from(session(h)?.hub().active()));
    function!("log", Option<Table>, |h, lua, options| looks::log(h, lua, options));
    function!("now", (), |h, lua, ()| Ok(clock(h).now().as_secs_f64()));
    function!("say", String, |h, lua, text| {
        (h.borrow().options.say)(&text);
        Ok(())
    });
    function!("fault", (String, String, Option<f64>, Option<f64>), |h, lua, (step, how, times, takes)| {
        h.borrow_mut().faults.add(&step, &how, times, takes)
    });
    type Injected = (String, String, Option<LuaValue>, Option<f64>);
    function!("inject", Injected, |h, lua, (component, what, with, at)| {
        inject::inject(h, lua, &component, &what, with, at)
    });
    function!("fail", String, |h, lua, component| {
        session(h)?;
        h.borrow().faults.fail(&component)
    });
    function!("shutdown", Option<Table>, |h, lua, options| deploying::shutdown(h, force("shutdown", options)?));
    // A name that is no function of ours is a typo: say so where it stands, instead of "a nil value".
    let meta = lua.create_table()?;
    meta.set(
        "__index",
        lua.create_function(|_, (_, name): (Table, String)| -> mlua::Result<LuaValue> {
            Err(error(format!("`{name}` is not defined: {}", meant(&name, None))))
        })?,
    )?;
    globals.set_metatable(Some(meta))
}

fn error(message: impl Into<String>) -> mlua::Error {
    mlua::Error::runtime(message.into())
}

fn clock(host: &SharedHost) -> Clock {
    host.borrow().options.clock.clone()
}

fn interrupt(host: &SharedHost) -> Interrupt {
    host.borrow().options.interrupt.clone()
}

fn session(host: &SharedHost) -> mlua::Result<Arc<Session>> {
    interrupt(host).check()?;
    if let Some(why) = host.borrow().injector.as_ref().and_then(inject::Injector::failure) {
        return Err(error(why));
    }
    host.borrow().session.clone().ok_or_else(|| error("nothing is deployed: call deploy(\"FILE\") first"))
}

fn deadline(host: &SharedHost, seconds: f64) -> mlua::Result<Time> {
    if !seconds.is_finite() || !(0.0..=1e6).contains(&seconds) {
        return Err(error(format!("{seconds} is not a number of seconds from 0 to 1000000")));
    }
    Ok(clock(host).now() + Duration::from_secs_f64(seconds))
}

/// The connection that a script is: what it asks for begins one after the other.
const LINE: u32 = 1;

fn raise(host: &SharedHost, name: &str, to: Option<Vec<String>>) -> mlua::Result<()> {
    let session = session(host)?;
    let names = session.coordinators();
    let known = |to: String| {
        names.iter().find(|name| name.as_str() == to).copied().ok_or_else(|| {
            let help = did_you_mean(&to, "coordinators", names.iter().map(Ident::as_str));
            error(format!("there is no coordinator `{to}`: {help}"))
        })
    };
    let to: Option<Vec<Ident>> = to.map(|to| to.into_iter().map(known).collect::<mlua::Result<_>>()).transpose()?;
    let event = session.named(name).map_err(|why| {
        let help = match &why {
            NotNamed::NotFromOutside(why) => why.help.clone(),
            _ => session.near_event(name),
        };
        error(format!("{why}: {help}"))
    })?;
    let given_to = session.given_to(event);
    if let Some(other) = to.iter().flatten().find(|name| !given_to.contains(name)) {
        let given_to = given_to.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        return Err(error(format!("`{name}` is no event of the coordinator `{other}`: it is given to {given_to}")));
    }
    listen_anew(host, &session);
    let offered = match to {
        Some(to) => session.offer_to(event, &to, "script"),
        None => session.offer(event, "script"),
    };
    offered.map_err(|why| error(format!("`{name}` was not delivered: {why}")))
}

/// From now on only what comes is news.
fn listen_anew(host: &SharedHost, session: &Session) {
    let mut host = host.borrow_mut();
    host.mark = session.hub().heard();
    host.taken.clear();
}

fn request(host: &SharedHost, id: Option<&str>, ask: fn(ConfigId) -> Ask, force: bool) -> mlua::Result<()> {
    let session = session(host)?;
    let ask = match id {
        None => Ask::Undo,
        Some(id) => {
            let known = session.configurations();
            let set = || session.setting(id).filter(|id| ask(*id).is_undo());
            ask(known.iter().find(|k| k.as_str() == id).copied().or_else(set).ok_or_else(|| {
                let help = did_you_mean(id, "configurations", known.iter().map(ConfigId::as_str));
                error(format!("there is no configuration `{id}`: {help}"))
            })?)
        }
    };
    listen_anew(host, &session);
    session.request_on(LINE, ask, "operator", force);
    Ok(())
}

fn recover(host: &SharedHost, how: &str) -> mlua::Result<()> {
    let Some(direction) = recovery(how) else {
        return Err(error(match how {
            "forward" => NO_FORWARD.to_owned(),
            _ => format!("recover(\"{how}\"): {}", did_you_mean(how, "ways", ["back", "accept"].into_iter())),
        }));
    };
    let recovered = session(host)?.recover(direction, "operator", RECOVERY);
    let recovered = recovered.ok_or_else(|| error("the recovery was not over in time"))?;
    if recovered.recovered {
        return Ok(());
    }
    let mut text = format!("still broken: {}", recovered.why.unwrap_or_default());
    for difference in &recovered.residual {
        text.push_str(&format!("\n  {difference}"));
    }
    Err(error(text))
}

//! `deploy(file)`: checked, brought up, and known to whoever may stop or steer it.

use super::failure::IsRefused;
use super::options::OptionFields;
use super::{SharedHost, clock, error, interrupt};
use crate::app::start::Played;
use crate::app::{StartError, check_while, read_for, start};
use crate::check::Halt;
use crate::lang::LoadOptions;
use crate::session::NotUp;
use mlua::Table;

pub(super) fn deploy(host: &SharedHost, file: &str, options: Option<Table>) -> mlua::Result<()> {
    let replay = OptionFields::of("deploy", options, &["replay"])?.flag("replay")?;
    interrupt(host).check()?;
    if host.borrow().session.is_some() {
        return Err(error("a deployment is already up: call shutdown() before the next deploy"));
    }
    let (path, checked) = {
        let mut host = host.borrow_mut();
        let path = host.folder.join(file);
        let set = host.parameters.for_deployments();
        let options = &host.options;
        let load = LoadOptions { set, ..options.load.clone() };
        let read = read_for(&path, &load, &options.extensions, options.platform);
        // Who wants it to end waits for no check.
        let interrupt = options.interrupt.clone();
        let tell = options.checking.as_ref().map(|begin| begin());
        let goes_on = |far| {
            tell.iter().for_each(|tell| tell(far));
            interrupt.check().map_err(|_| Halt::Interrupted)
        };
        let checked = read.and_then(|read| check_while(read, replay, &goes_on));
        (path, checked)
    };
    interrupt(host).check()?;
    if let Ok(checked) = &checked
        && replay
        && (!checked.deployment.kind.imitates || !clock(host).is_simulated())
    {
        return Err(error("a way is replayed with `--platform simulated --clock simulated` only"));
    }
    let checked = checked.map_err(|refused| {
        let unread = host.borrow().parameters.refused(&refused);
        if let Some(unread) = unread {
            host.borrow_mut().unread = Some(unread.clone());
            return error(unread);
        }
        let told = IsRefused::of(file, &refused);
        host.borrow_mut().refused = Some((path.clone(), Box::new(refused)));
        mlua::Error::external(told)
    })?;
    let clock = clock(host);
    host.borrow().faults.fit(&checked)?;
    let played = if replay { Played::Replayed } else { Played::Steered };
    let started = start::start_open(&checked, &clock, played);
    let (session, simulated) = started.map_err(|e: StartError| error(e.to_string()))?;
    if !clock.is_simulated() {
        let door = host.borrow().options.door.as_ref().map(|open| open(&session, &path)).transpose().map_err(error)?;
        host.borrow_mut().door = door;
    }
    host.borrow_mut().faults.up(checked, simulated);
    if let Some(observer) = &host.borrow().options.observer {
        session.hub().attach(observer.clone());
    }
    interrupt(host).up(&session);
    // There is nobody who is waited for.
    if clock.is_simulated() {
        session.unattended();
    }
    // On a way it is let go when the script says so: `check` follows that as an event from outside.
    if replay {
        session.played_by_parent();
    }
    // A replay raises the events itself.
    match if replay { Ok(()) } else { session.bring_up() } {
        Ok(()) => {
            let mut host = host.borrow_mut();
            host.mark = 0;
            host.taken.clear();
            host.session = Some(session);
            Ok(())
        }
        Err(NotUp { why, reasons, ended, .. }) => {
            let mut text = format!("{file} did not come up: {why}");
            for reason in reasons.iter().chain(&ended.left) {
                text.push_str("\n  ");
                text.push_str(reason);
            }
            let mut host = host.borrow_mut();
            host.ended = Some(ended);
            host.door = None;
            host.faults.down();
            Err(error(text))
        }
    }
}

/// Takes down what is up.
pub(super) fn shutdown(host: &SharedHost, force: bool) -> mlua::Result<()> {
    let session = super::session(host)?;
    let ended = session.take_down(force);
    let mut host = host.borrow_mut();
    host.down();
    let clean = ended.is_clean();
    let left = ended.left.join(", ");
    host.ended = Some(ended);
    if clean { Ok(()) } else { Err(error(format!("the shutdown left something behind: {left}"))) }
}

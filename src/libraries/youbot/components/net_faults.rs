//! Faults of a network, as a script injects them: for a time, or until it is healed.

use crate::libraries::youbot::network::{NetworkFault, NetworkFaults};
use crate::runtime::{Builder, Component};
use crate::time::Time;
use std::time::Duration;

/// The longest time of a fault that ends by itself, in s.
const LONGEST: f64 = 3600.0;

/// The injections of a component that has a network, or an end of one.
pub(super) fn offer_network_faults<C: Component>(
    b: &mut Builder<C>,
    of: impl Fn(&mut C) -> &mut NetworkFaults + Copy + Send + Sync + 'static,
) {
    for fault in NetworkFault::ALL {
        let (name, unit, largest, what) = words(fault);
        b.doc(&format!("{what}, for that time (0: until heal). Then it is again as it should be."));
        if let NetworkFault::Cut = fault {
            seconds(b).injection(name, move |c, cx, (seconds,): (f64,)| {
                of(c).begin(fault, 0.0, end(cx.now(), seconds));
                Ok(())
            });
            continue;
        }
        if let Some(unit) = unit {
            b.unit(unit);
        }
        b.range(0.0..=largest).parameter(name, None::<f64>);
        seconds(b).injection(name, move |c, cx, (figure, seconds): (f64, f64)| {
            of(c).begin(fault, figure, end(cx.now(), seconds));
            Ok(())
        });
    }
    b.doc("The tool's position is wrong by so much in what is sent, for that time (0: until heal). All else of a packet is right.")
        .unit("m")
        .range(-10.0..=10.0)
        .parameter("by", None::<[f64; 3]>);
    seconds(b).injection("corrupt", move |c, cx, (by, seconds): ([f64; 3], f64)| {
        of(c).displace(by, end(cx.now(), seconds));
        Ok(())
    });
    b.doc("Nothing that was injected is wrong with the network any more.").injection("heal", move |c, _, (): ()| {
        of(c).heal();
        Ok(())
    });
}

fn seconds<C: Component>(b: &mut Builder<C>) -> &mut Builder<C> {
    b.unit("s").range(0.0..=LONGEST).parameter("seconds", Some(0.0_f64))
}

/// When a fault is over that begins now.
fn end(now: Time, seconds: f64) -> Time {
    if seconds > 0.0 { now + Duration::from_secs_f64(seconds) } else { Time::NEVER }
}

/// Its name, the unit and the largest value of its figure, and what happens.
fn words(fault: NetworkFault) -> (&'static str, Option<&'static str>, f64, &'static str) {
    match fault {
        NetworkFault::Cut => ("cut", None, 0.0, "Nothing that is sent gets through"),
        NetworkFault::Delay => ("delay", Some("s"), 1.0, "One way takes so long"),
        NetworkFault::Jitter => ("jitter", Some("s"), 1.0, "Up to so much is added to the delay, with the order kept"),
        NetworkFault::Reorder => ("reorder", None, 1.0, "Such a share of packets takes 10 ms longer"),
        NetworkFault::Duplicate => ("duplicate", None, 1.0, "Such a share of packets comes twice"),
        NetworkFault::Loss => ("loss", None, 1.0, "Such a share of packets is lost, one by one"),
        NetworkFault::Rate => {
            ("rate", Some("1/s"), 100_000.0, "So many packets get through in a second (0: any number)")
        }
    }
}

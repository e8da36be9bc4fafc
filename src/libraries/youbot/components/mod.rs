//! The components: ports, properties and operations around the laws of the neighbouring files.

mod base_ctrl;
mod driver;
mod dynamics;
mod impedance;
mod kinematics;
mod link;
mod net;
mod net_faults;
mod operator;
mod passivity;
mod peer;
mod reporter;
pub mod samples;
mod udp;
mod world;

pub use base_ctrl::BaseCtrl;
pub use driver::Driver;
pub use dynamics::DynamicsComponent;
pub use impedance::CartImpedance;
pub use kinematics::ArmKinematics;
pub use link::{LinkRx, LinkTx};
pub use net::Net;
pub use operator::{ModeSwitch, Operator};
pub use passivity::CouplingObserver;
pub use peer::Peer;
pub use reporter::Reporter;
pub use udp::Udp;
pub use world::YoubotWorld;

use crate::libraries::youbot::robot::CONTROL_PERIOD;
use crate::runtime::{Context, In, Library, PortValue};
use samples::seconds_since;

/// The library `youbot`.
pub fn library() -> Library {
    Library::new("youbot")
        .with::<YoubotWorld>("youbot.World")
        .with::<Driver>("youbot.Driver")
        .with::<ArmKinematics>("youbot.Arm_Kinematics")
        .with::<CartImpedance>("youbot.Cart_Impedance")
        .with::<DynamicsComponent>("youbot.Dynamics")
        .with::<BaseCtrl>("youbot.Base_Ctrl")
        .with::<LinkTx>("youbot.Link_Tx")
        .with::<LinkRx>("youbot.Link_Rx")
        .with::<Net>("youbot.Net")
        .with::<Udp>("youbot.Udp")
        .with::<Peer>("youbot.Peer")
        .with::<CouplingObserver>("youbot.Passivity_Observer")
        .with::<Operator>("youbot.Operator")
        .with::<ModeSwitch>("youbot.Mode_Switch")
        .with::<Reporter>("youbot.Reporter")
}

/// How far an update takes the ramps, filters and integrators of a controller, in s: one period, however long it was held up before. What it
/// missed it does not make up for at once; it goes on from where it was. How long something was not heard, and how fast something changed, is another
/// question: that is asked of the clock.
fn going_on(cx: &Context) -> f64 {
    let period = if cx.period() > 0.0 { cx.period() } else { CONTROL_PERIOD };
    cx.dt().min(period)
}

/// The value at a port with its age in s.
fn aged<T: PortValue>(port: &mut In<T>, cx: &Context) -> Option<(T, f64)> {
    port.sample().map(|sample| (sample.value.clone(), seconds_since(cx.now(), sample.at)))
}

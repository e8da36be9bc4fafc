//! The library `scara`: an arm on a rail, with its drives, what makes it follow, and what it follows.

mod coupling;
mod driver;
mod drives;
mod follower;
mod leader;
pub mod model;
mod plant;
mod samples;

use davit::component::{Context, In, Library, PortValue};

/// The library.
pub fn library() -> Library {
    Library::new("scara")
        .with::<plant::Plant>("scara.Plant")
        .with::<driver::Driver>("scara.Drives")
        .with::<follower::Follower>("scara.Follower")
        .with::<follower::Torques>("scara.Torques")
        .with::<leader::Leader>("scara.Leader")
}

/// The value at a port with its age in s.
fn aged<T: PortValue>(port: &mut In<T>, cx: &Context) -> Option<(T, f64)> {
    port.sample().map(|sample| (sample.value.clone(), cx.now().since(sample.at).as_secs_f64()))
}

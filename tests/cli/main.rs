//! The command line as people and programs meet it: what is printed, in which shape, with which exit status.

mod agree;
mod answered;
mod background;
mod breakages;
mod commands;
mod crowded;
mod declared;
mod demo;
mod explored;
mod faults;
mod force;
mod foreground;
mod hot_swap;
mod listed;
mod lost;
mod monitor;
mod motion;
mod recovery;
mod several;
mod simulated;
mod stalled;
mod together;
mod unasked;
mod unheard;
mod vanished;
mod words;

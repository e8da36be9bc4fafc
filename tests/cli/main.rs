//! The command line as people and programs meet it: what is printed, in which shape, with which exit status.

mod agree;
mod background;
mod booked;
mod breakages;
mod commands;
mod declared;
mod demo;
mod explored;
mod faults;
mod force;
mod hot_swap;
mod lies;
mod listed;
mod lost;
mod monitor;
mod motion;
mod recovery;
mod several;
mod simulated;
mod together;
mod unasked;
mod unheard;
mod words;

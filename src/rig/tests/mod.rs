mod explore;
mod faults;
mod laser;
mod moving;
mod scan;
mod simulated;

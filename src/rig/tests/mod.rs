mod laser;
mod moving;

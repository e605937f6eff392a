//! Figures for this machine, printed as tables: run with `make bench`. Nothing
//! here is asserted; compare within a run.

mod step;

fn main() {
    step::print();
}

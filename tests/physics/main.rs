//! Physics that can be checked: each test states its formula or source, its
//! tolerance and why.

mod mujoco;
mod properties;
mod random_robots;
mod seven_arm;
mod world;

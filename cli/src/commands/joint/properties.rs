//! `simctl joint properties`: changes properties of joints while the world runs.

use anyhow::bail;
use clap::Args;
use serde::Serialize;
use simd_client::{
    Client,
    proto::{JointGains, JointProperties, JointSpring},
};

use crate::{
    complete,
    output::{Output, View, json::Stamp, number::count, table::Page},
};

#[derive(Args, Debug)]
pub(crate) struct Properties {
    /// Name of the robot
    #[arg(add = complete::robots())]
    robot: String,
    /// Names of the joints
    #[arg(required = true, add = complete::joints())]
    joints: Vec<String>,
    /// Viscous damping, N m s/rad or N s/m
    #[arg(long, value_name = "DAMPING", allow_negative_numbers = true)]
    damping: Option<f64>,
    /// Dry friction, N m or N
    #[arg(long, value_name = "EFFORT", allow_negative_numbers = true)]
    friction: Option<f64>,
    /// Rotor inertia seen at the joint, kg m^2 or kg
    #[arg(long, value_name = "INERTIA", allow_negative_numbers = true)]
    armature: Option<f64>,
    /// Spring in addition to the actuator: stiffness, N m/rad or N/m, and rest position, rad or m; stiffness
    /// 0 removes it
    #[arg(long, value_names = ["STIFFNESS", "REST"], num_args = 2, allow_negative_numbers = true)]
    spring: Option<Vec<f64>>,
    /// Default stiffness and damping of targets, N m/rad and N m s/rad or N/m and N s/m
    #[arg(long, value_names = ["KP", "KD"], num_args = 2, allow_negative_numbers = true)]
    default_gains: Option<Vec<f64>>,
    /// Whether the actuator compensates the weight of what hangs on the joint
    #[arg(long, value_name = "on|off", value_parser = on_or_off)]
    gravity_compensation: Option<bool>,
    /// Whether the setpoint follows a velocity profile on its way to a position target
    #[arg(long, value_name = "on|off", value_parser = on_or_off)]
    profile: Option<bool>,
}

fn on_or_off(text: &str) -> Result<bool, &'static str> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("must be on or off"),
    }
}

pub(super) async fn set(arguments: Properties, client: &Client, output: Output) -> anyhow::Result<()> {
    let Properties {
        robot,
        joints,
        damping,
        friction,
        armature,
        spring,
        default_gains,
        gravity_compensation,
        profile,
    } = arguments;
    let default_gains = match default_gains.as_deref() {
        Some(&[stiffness, damping]) => Some(JointGains { stiffness, damping }),
        _ => None,
    };
    let spring = match spring.as_deref() {
        Some(&[stiffness, rest]) => Some(JointSpring { stiffness, rest }),
        _ => None,
    };
    let changes = JointProperties {
        damping,
        friction,
        armature,
        spring,
        default_gains,
        gravity_compensation,
        profile,
        ..JointProperties::default()
    };
    if changes == JointProperties::default() {
        bail!("nothing to change: see --help");
    }
    let of = |joint: &String| JointProperties { joint: joint.clone(), ..changes.clone() };
    let stamp = client.set_joint_properties(&robot, joints.iter().map(of).collect()).await?;
    output.one(&Changed { robot, joints, stamp: stamp.into() })
}

#[derive(Serialize)]
struct Changed {
    robot: String,
    joints: Vec<String>,
    stamp: Stamp,
}

impl View for Changed {
    fn page(&self) -> Page {
        let Self { robot, joints, stamp } = self;
        Page::of_line(format!("{robot}: properties of {} from {stamp}", count(joints.len(), "joint")))
    }
}

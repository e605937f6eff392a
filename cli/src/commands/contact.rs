//! `simctl contact`: contacts, ray casts, distances, surfaces.

mod query;
mod ray;
mod view;

use clap::{Args, Subcommand};
use simd_client::{Client, proto::LinkProperties};

use crate::{complete, output::Output};
use view::SurfaceView;

#[derive(Debug, Subcommand)]
pub(crate) enum Contact {
    /// Shows the contacts of links: point, depth and force
    List {
        /// Show only contacts of this robot
        #[arg(add = complete::robots())]
        robot: Option<String>,
    },
    /// Shows the first hit of a ray, or of several
    Ray(ray::Ray),
    /// Shows distances between links and shapes, also for other configurations of a robot
    Distance(query::Distance),
    /// Shows the links that a shape overlaps
    Overlaps(query::Overlaps),
    /// Shows the first hit of a shape that moves in a straight line
    Cast(query::Cast),
    /// Shows the boxes around links, along the world's axes
    Bounds {
        /// Show only links of this robot
        #[arg(add = complete::robots())]
        robot: Option<String>,
    },
    /// Shows friction and restitution of a robot's links
    Surfaces {
        /// Name of the robot
        #[arg(add = complete::robots())]
        robot: String,
    },
    /// Changes friction and restitution of a robot's links
    Set(Set),
}

#[derive(Args, Debug)]
pub(crate) struct Set {
    /// Name of the robot
    #[arg(add = complete::robots())]
    robot: String,
    /// Name of the link; all links if left out
    #[arg(long)]
    link: Option<String>,
    #[command(flatten)]
    surface: Surface,
}

/// Values of a surface.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(crate) struct Surface {
    /// Coefficient of dry friction, at least 0; the smaller of two touching surfaces applies, unless the
    /// world combines them otherwise
    #[arg(long, value_name = "MU", allow_negative_numbers = true)]
    friction: Option<f64>,
    /// Restitution, from 0 (no bounce) to 1 (no loss of speed); the larger of two touching surfaces applies
    #[arg(long, value_name = "E", allow_negative_numbers = true)]
    restitution: Option<f64>,
    /// Rolling friction, metres: the torque is at most this times the normal force; the larger of two
    /// touching surfaces applies
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    rolling_friction: Option<f64>,
    /// Spinning friction, metres: bounds the torque about the normal in the same way
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    spinning_friction: Option<f64>,
    /// Stiffness of the spring at each contact point, N/m; 0 is rigid
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    contact_stiffness: Option<f64>,
    /// Damping in parallel with that spring, N s/m
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    contact_damping: Option<f64>,
}

impl Surface {
    /// Returns the values for a link, or for all if none is named. `None` if no value was given.
    pub(crate) fn of(self, link: Option<String>) -> Option<LinkProperties> {
        let Self {
            friction,
            restitution,
            rolling_friction,
            spinning_friction,
            contact_stiffness,
            contact_damping,
        } = self;
        let given =
            [friction, restitution, rolling_friction, spinning_friction, contact_stiffness, contact_damping];
        given.iter().any(Option::is_some).then(|| LinkProperties {
            link: link.unwrap_or_default(),
            friction,
            restitution,
            rolling_friction,
            spinning_friction,
            contact_stiffness,
            contact_damping,
            ..LinkProperties::default()
        })
    }
}

pub(crate) async fn run(command: Contact, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Contact::List { robot } => {
            let contacts = client.contacts(robot.as_deref()).await?;
            let contacts: Vec<_> = contacts.into_iter().map(view::ContactView::from).collect();
            output.list(&contacts, view::contacts)
        }
        Contact::Ray(arguments) => ray::run(arguments, client, output).await,
        Contact::Distance(arguments) => query::distance(arguments, client, output).await,
        Contact::Overlaps(arguments) => query::overlaps(arguments, client, output).await,
        Contact::Cast(arguments) => query::cast(arguments, client, output).await,
        Contact::Bounds { robot } => query::bounds(robot.as_deref(), client, output).await,
        Contact::Surfaces { robot } => surfaces(&robot, client, output).await,
        Contact::Set(Set { robot, link, surface }) => {
            let Some(properties) = surface.of(link) else {
                anyhow::bail!(
                    "give at least one of: --friction, --restitution, --rolling-friction, \
                     --spinning-friction, --contact-stiffness or --contact-damping"
                );
            };
            client.set_link_properties(&robot, [properties]).await?;
            surfaces(&robot, client, output).await
        }
    }
}

async fn surfaces(robot: &str, client: &Client, output: Output) -> anyhow::Result<()> {
    let links = client.link_properties(robot).await?;
    let links: Vec<_> = links.into_iter().map(SurfaceView::from).collect();
    output.list(&links, view::surfaces)
}

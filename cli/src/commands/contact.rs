//! `simctl contact`: what touches what, what rays hit, what surfaces are like.

mod query;
mod ray;
mod view;

use clap::{Args, Subcommand};
use simd_client::{Client, proto::LinkProperties};

use crate::{complete, output::Output};
use view::SurfaceView;

#[derive(Debug, Subcommand)]
pub(crate) enum Contact {
    /// Shows the points at which links touch: where, how deep, with what force
    List {
        /// Only contacts of this robot
        #[arg(add = complete::robots())]
        robot: Option<String>,
    },
    /// Shows what a straight line, or each of several, meets first
    Ray(ray::Ray),
    /// Shows how far links and shapes are apart, also where a robot is not
    Distance(query::Distance),
    /// Shows the links that a shape overlaps
    Overlaps(query::Overlaps),
    /// Shows what a shape meets first on a straight way
    Cast(query::Cast),
    /// Shows the boxes around links, along the world's axes
    Bounds {
        /// Only of this robot
        #[arg(add = complete::robots())]
        robot: Option<String>,
    },
    /// Shows how a robot's links rub and bounce
    Surfaces {
        /// The robot's name
        #[arg(add = complete::robots())]
        robot: String,
    },
    /// Changes how a robot's links rub and bounce
    Set(Set),
}

#[derive(Args, Debug)]
pub(crate) struct Set {
    /// The robot's name
    #[arg(add = complete::robots())]
    robot: String,
    /// Only this link; all of them where it is left out
    #[arg(long)]
    link: Option<String>,
    #[command(flatten)]
    surface: Surface,
}

/// What a surface can be given.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(crate) struct Surface {
    /// Coefficient of dry friction, at least 0; of two that touch the smaller counts, unless the world combines them otherwise
    #[arg(long, value_name = "MU", allow_negative_numbers = true)]
    friction: Option<f64>,
    /// 0: does not bounce, to 1: loses no speed; of two that touch the larger counts
    #[arg(long, value_name = "E", allow_negative_numbers = true)]
    restitution: Option<f64>,
    /// Friction against rolling, metres: its torque is at most this times the normal force; of two that touch the larger
    /// counts
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    rolling_friction: Option<f64>,
    /// The same against turning about the normal
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    spinning_friction: Option<f64>,
    /// The spring that each point of a contact is, N/m; 0 is rigid
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    contact_stiffness: Option<f64>,
    /// The damper beside that spring, N s/m
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    contact_damping: Option<f64>,
}

impl Surface {
    /// For a link; for all where it is not named. None where nothing was given.
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
                    "say what is to change: --friction, --restitution, --rolling-friction, --spinning-friction, \
                     --contact-stiffness or --contact-damping"
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

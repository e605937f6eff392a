//! Actions of keys: the chosen world and robot, their order, and play or pause.

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use super::world::{Link, RobotRow, World};

/// Table that arrow keys apply to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Focus {
    #[default]
    Worlds,
    Robots,
}

/// Order of worlds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum WorldOrder {
    #[default]
    AsFound,
    Name,
    /// The slowest first.
    RealTimeFactor,
    /// The longest first.
    StepDuration,
    /// The most first.
    Calls,
}

/// Order of robots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum RobotOrder {
    #[default]
    AsLoaded,
    Name,
    /// The most first.
    Joints,
    /// Claimed ones first, by holder.
    Claim,
}

/// An action on a world that awaits confirmation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Question {
    pub(super) endpoint: String,
    pub(super) label: String,
    pub(super) play: bool,
}

/// Effect of a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Effect {
    Nothing,
    Quit,
    Do(Question),
}

/// State of the screen between two pictures.
#[derive(Debug, Default)]
pub(super) struct App {
    pub(super) focus: Focus,
    pub(super) world_order: WorldOrder,
    pub(super) robot_order: RobotOrder,
    /// By its endpoint: rows move when they are sorted.
    chosen: Option<String>,
    /// By its name.
    robot: Option<String>,
    pub(super) question: Option<Question>,
    /// Result of the last action.
    pub(super) message: Option<String>,
}

impl App {
    /// Sorts the worlds in the order of the screen.
    pub(super) fn sort(&self, worlds: &mut [World]) {
        let descending = |a: Option<f64>, b: Option<f64>| b.unwrap_or(-1.0).total_cmp(&a.unwrap_or(-1.0));
        match self.world_order {
            WorldOrder::AsFound => {}
            WorldOrder::Name => worlds.sort_by(|a, b| a.label().cmp(b.label())),
            WorldOrder::RealTimeFactor => {
                let factor = |of: &World| of.real_time_factor.unwrap_or(f64::INFINITY);
                worlds.sort_by(|a, b| factor(a).total_cmp(&factor(b)));
            }
            WorldOrder::StepDuration => worlds.sort_by(|a, b| descending(a.step_duration, b.step_duration)),
            WorldOrder::Calls => worlds.sort_by(|a, b| descending(a.calls_per_second, b.calls_per_second)),
        }
        for world in worlds {
            let robots = &mut world.robots;
            match self.robot_order {
                RobotOrder::AsLoaded => {}
                RobotOrder::Name => robots.sort_by(|a, b| a.name.cmp(&b.name)),
                RobotOrder::Joints => robots.sort_by_key(|robot| std::cmp::Reverse(robot.moving_joints)),
                RobotOrder::Claim => {
                    let key = |of: &RobotRow| (of.claimed_by.is_none(), of.claimed_by.clone());
                    robots.sort_by_key(key);
                }
            }
        }
    }

    /// Returns the row of the chosen world; the first if none is chosen, or if it is gone.
    pub(super) fn world_row(&self, worlds: &[World]) -> Option<usize> {
        row(worlds, |world| Some(&world.endpoint) == self.chosen.as_ref())
    }

    /// Returns the chosen world.
    pub(super) fn world<'a>(&self, worlds: &'a [World]) -> Option<&'a World> {
        worlds.get(self.world_row(worlds)?)
    }

    /// Returns the row of the chosen robot; the first if none is chosen, or if it is gone.
    pub(super) fn robot_row(&self, world: &World) -> Option<usize> {
        row(&world.robots, |robot| Some(&robot.name) == self.robot.as_ref())
    }

    pub(super) fn key(&mut self, key: KeyEvent, worlds: &[World]) -> Effect {
        if key.kind == KeyEventKind::Release {
            return Effect::Nothing;
        }
        self.message = None;
        if key.modifiers.contains(KeyModifiers::CONTROL) && key.code == KeyCode::Char('c') {
            return Effect::Quit;
        }
        if let Some(question) = self.question.take() {
            return match key.code {
                KeyCode::Char('y' | 'Y') => Effect::Do(question),
                _ => Effect::Nothing,
            };
        }
        match key.code {
            KeyCode::Char('q') | KeyCode::Esc => return Effect::Quit,
            KeyCode::Up | KeyCode::Char('k') => self.go(-1, worlds),
            KeyCode::Down | KeyCode::Char('j') => self.go(1, worlds),
            KeyCode::PageUp => self.go(-10, worlds),
            KeyCode::PageDown => self.go(10, worlds),
            KeyCode::Home => self.go(isize::MIN, worlds),
            KeyCode::End => self.go(isize::MAX, worlds),
            KeyCode::Tab | KeyCode::BackTab | KeyCode::Left | KeyCode::Right => {
                self.focus = match self.focus {
                    Focus::Worlds => Focus::Robots,
                    Focus::Robots => Focus::Worlds,
                };
            }
            KeyCode::Char('s') => self.sort_otherwise(),
            KeyCode::Char('p') => self.ask(worlds),
            _ => {}
        }
        Effect::Nothing
    }

    fn go(&mut self, by: isize, worlds: &[World]) {
        let moved = |row: Option<usize>, rows: usize| {
            row.unwrap_or_default().saturating_add_signed(by).min(rows.saturating_sub(1))
        };
        match self.focus {
            Focus::Worlds => {
                let row = moved(self.world_row(worlds), worlds.len());
                self.chosen = worlds.get(row).map(|world| world.endpoint.clone());
                self.robot = None;
            }
            Focus::Robots => {
                let Some(world) = self.world(worlds) else { return };
                let row = moved(self.robot_row(world), world.robots.len());
                self.robot = world.robots.get(row).map(|robot| robot.name.clone());
            }
        }
    }

    fn sort_otherwise(&mut self) {
        match self.focus {
            Focus::Worlds => {
                self.world_order = match self.world_order {
                    WorldOrder::AsFound => WorldOrder::Name,
                    WorldOrder::Name => WorldOrder::RealTimeFactor,
                    WorldOrder::RealTimeFactor => WorldOrder::StepDuration,
                    WorldOrder::StepDuration => WorldOrder::Calls,
                    WorldOrder::Calls => WorldOrder::AsFound,
                };
            }
            Focus::Robots => {
                self.robot_order = match self.robot_order {
                    RobotOrder::AsLoaded => RobotOrder::Name,
                    RobotOrder::Name => RobotOrder::Joints,
                    RobotOrder::Joints => RobotOrder::Claim,
                    RobotOrder::Claim => RobotOrder::AsLoaded,
                };
            }
        }
    }

    fn ask(&mut self, worlds: &[World]) {
        let Some(world) = self.world(worlds) else { return };
        if world.link != Link::Here {
            self.message = Some(format!("{} does not answer", world.label()));
            return;
        }
        let play = world.state.as_deref() != Some("playing");
        let (endpoint, label) = (world.endpoint.clone(), world.label().to_owned());
        self.question = Some(Question { endpoint, label, play });
    }
}

impl WorldOrder {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::AsFound => "as found",
            Self::Name => "name",
            Self::RealTimeFactor => "real-time factor",
            Self::StepDuration => "step duration",
            Self::Calls => "calls",
        }
    }
}

impl RobotOrder {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::AsLoaded => "as loaded",
            Self::Name => "name",
            Self::Joints => "joints",
            Self::Claim => "claim",
        }
    }
}

fn row<T>(rows: &[T], is_chosen: impl Fn(&T) -> bool) -> Option<usize> {
    rows.iter().position(is_chosen).or((!rows.is_empty()).then_some(0))
}

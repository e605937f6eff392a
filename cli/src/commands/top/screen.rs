//! The terminal of `simctl top`: draws after changes, and reads keys.

use std::{io, thread, time::Duration};

use ratatui::{
    DefaultTerminal,
    crossterm::event::{self, Event},
};
use simd_client::{Client, Error};
use tokio::sync::mpsc;

use super::{
    app::{App, Effect, Question},
    draw::draw,
    watch::Board,
    world::World,
};

/// Interval of the checks whether the reader of keys has ended.
const CHECK_INTERVAL: Duration = Duration::from_millis(100);
/// Maximum number of waiting keys; further ones stay in the terminal.
const WAITING: usize = 64;

/// Runs until `q`, Ctrl-C, SIGTERM, or the end of the terminal. Restores the terminal.
pub(super) async fn run(board: &Board, claim: &str, colour: bool) -> anyhow::Result<()> {
    let mut terminal = ratatui::try_init()?;
    let shown = show(&mut terminal, board, claim, colour).await;
    ratatui::try_restore()?;
    shown
}

async fn show(
    terminal: &mut DefaultTerminal,
    board: &Board,
    claim: &str,
    colour: bool,
) -> anyhow::Result<()> {
    let mut keys = keys();
    let mut app = App::default();
    let (done, mut was_done) = mpsc::channel::<String>(1);
    let mut end = std::pin::pin!(end());
    loop {
        let mut worlds = board.worlds();
        app.sort(&mut worlds);
        board.choose(app.world(&worlds).map(|world| world.endpoint.as_str()));
        terminal.draw(|frame| draw(frame, &app, &worlds, colour))?;
        tokio::select! {
            () = board.changed() => {}
            event = keys.recv() => match event {
                Some(Ok(event)) => {
                    if !hear(&event, &mut app, &worlds, board, claim, &done) {
                        return Ok(());
                    }
                }
                Some(Err(error)) => return Err(error.into()),
                None => return Ok(()),
            },
            Some(message) = was_done.recv() => {
                app.message = Some(message);
                board.hurry();
            }
            () = &mut end => return Ok(()),
        }
    }
}

/// Handles an event; returns whether to continue.
fn hear(
    event: &Event,
    app: &mut App,
    worlds: &[World],
    board: &Board,
    claim: &str,
    done: &mpsc::Sender<String>,
) -> bool {
    // A new size is drawn like all changes.
    let Event::Key(key) = event else { return true };
    match app.key(*key, worlds) {
        Effect::Nothing => {}
        Effect::Quit => return false,
        Effect::Do(question) => match board.client(&question.endpoint) {
            Some(client) => {
                let (client, done) = (client.with_claim(claim), done.clone());
                tokio::spawn(async move {
                    let message = match change(&client, &question).await {
                        Ok(()) if question.play => format!("{} plays", question.label),
                        Ok(()) => format!("{} is paused", question.label),
                        Err(error) => format!("{}: {error}", question.label),
                    };
                    // The screen may have ended.
                    let _ = done.send(message).await;
                });
            }
            None => app.message = Some(format!("{} does not answer", question.label)),
        },
    }
    true
}

async fn change(client: &Client, question: &Question) -> Result<(), Error> {
    match question.play {
        true => client.play().await.map(drop),
        false => client.pause().await.map(drop),
    }
}

/// Reads keys and new sizes on a separate thread, since reading blocks.
fn keys() -> mpsc::Receiver<io::Result<Event>> {
    let (send, heard) = mpsc::channel(WAITING);
    thread::spawn(move || {
        loop {
            let event = match event::poll(CHECK_INTERVAL) {
                Ok(false) if send.is_closed() => return,
                Ok(false) => continue,
                Ok(true) => event::read(),
                Err(error) => Err(error),
            };
            let is_end = event.is_err();
            if send.blocking_send(event).is_err() || is_end {
                return;
            }
        }
    });
    heard
}

/// Waits for signals that end programs: the terminal must be restored.
async fn end() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        if let (Ok(mut terminate), Ok(mut hang_up)) =
            (signal(SignalKind::terminate()), signal(SignalKind::hangup()))
        {
            tokio::select! {
                _ = terminate.recv() => {}
                _ = hang_up.recv() => {}
                _ = tokio::signal::ctrl_c() => {}
            }
            return;
        }
    }
    let _ = tokio::signal::ctrl_c().await;
}

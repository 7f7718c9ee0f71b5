//! What a camera is at: the commands in its sockets, and how far its moves have come.

/// What a command moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    Head = 0,
    Zoom = 1,
}

/// How far the last move has come, as the camera says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// Nothing to wait for.
    Done,
    /// Its completion will come.
    Running,
    /// It was taken, and its completion will not come.
    Untold,
    Failed,
}

/// A command that was taken and has not ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Job {
    axis: Option<Axis>,
    /// Only the last move of an axis counts.
    id: u64,
}

/// The commands that a camera has taken. It has two sockets; the protocol has numbers for sixteen.
#[derive(Debug)]
pub struct Jobs {
    running: [Option<Job>; 16],
    progress: [Progress; 2],
    /// Number of the last command, and of the last one of each axis.
    last_id: u64,
    latest: [u64; 2],
}

impl Default for Jobs {
    fn default() -> Self {
        Self { running: [None; 16], progress: [Progress::Done; 2], last_id: 0, latest: [0; 2] }
    }
}

impl Jobs {
    pub fn progress(&self, axis: Axis) -> Progress {
        self.progress[axis as usize]
    }

    /// Forgets how far moves have come.
    pub fn set_done(&mut self) {
        self.progress = [Progress::Done; 2];
    }

    /// The camera was made to forget its commands.
    pub fn forget(&mut self) {
        self.running = [None; 16];
        for progress in &mut self.progress {
            if *progress == Progress::Running {
                *progress = Progress::Untold;
            }
        }
    }

    /// The camera has taken a command. Without a socket its end will not be told.
    pub fn begin(&mut self, axis: Option<Axis>, socket: Option<u8>) {
        self.last_id += 1;
        if let Some(axis) = axis {
            self.progress[axis as usize] = if socket.is_some() { Progress::Running } else { Progress::Untold };
            self.latest[axis as usize] = self.last_id;
        }
        if let Some(slot) = socket.and_then(|socket| self.running.get_mut(usize::from(socket))) {
            *slot = Some(Job { axis, id: self.last_id });
        }
    }

    /// It has taken something that nobody waited for.
    pub fn begin_unknown(&mut self, socket: u8) {
        if let Some(slot) = self.running.get_mut(usize::from(socket)) {
            *slot = slot.or(Some(Job { axis: None, id: 0 }));
        }
    }

    pub fn begin_and_end(&mut self, axis: Option<Axis>) {
        self.begin(axis, None);
        if let Some(axis) = axis {
            self.progress[axis as usize] = Progress::Done;
        }
    }

    /// What was in the socket has ended; false when nothing was.
    pub fn end(&mut self, socket: u8, how: Progress) -> bool {
        let Some(job) = self.running.get_mut(usize::from(socket)).and_then(Option::take) else { return false };
        if let Some(axis) = job.axis.filter(|&axis| self.latest[axis as usize] == job.id) {
            self.progress[axis as usize] = how;
        }
        true
    }
}

//! Requests and replies, and their bytes.

use crate::Error;

/// Version of the messages; the worker names its own in [`Reply::Hello`].
pub const PROTOCOL: u32 = 1;

/// A request of the compiler.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Tetrahedralize.
    Job(Job),
    /// Fail in a given way, for tests of the compiler.
    Fault(Fault),
}

/// A piecewise linear complex to tetrahedralize.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Job {
    /// TetGen's switches, ASCII without NUL.
    pub switches: String,
    /// Points; their order is kept.
    pub points: Vec<[f64; 3]>,
    /// Triangular facets, rows of `points`. Facet markers are the row plus 1.
    pub triangles: Vec<[u32; 3]>,
    /// Facets of the surrounding box, rows of `points`. Markers are minus (row plus 1).
    pub quads: Vec<[u32; 4]>,
}

/// A planted fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Die by a signal.
    Crash,
    /// Never answer.
    Hang,
    /// Take all memory there is.
    Hog,
    /// Send bytes that are no reply.
    Garble,
    /// Send a second [`Reply::Hello`].
    Greet,
    /// Answer with tetrahedra of other points than were sent.
    Invent,
    /// Reply that the job failed.
    Fail(Failure),
}

/// Bit that marks the code of a fault as a [`Failure`].
const FAIL: u8 = 0x80;

/// A reply of the worker.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// Sent once, before any request, when the worker is ready.
    Hello {
        /// [`PROTOCOL`] of the worker.
        protocol: u32,
        /// TetGen's version, such as `1.5`.
        tetgen: String,
    },
    /// The job is done.
    Done(Tetrahedra),
    /// The job failed; the worker should be replaced.
    Failed {
        /// Why.
        failure: Failure,
        /// Message for the user.
        text: String,
    },
}

/// A tetrahedralization of a [`Job`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tetrahedra {
    /// The job's points, then those that TetGen added.
    pub points: Vec<[f64; 3]>,
    /// Rows of `points`.
    pub tets: Vec<[u32; 4]>,
}

/// Why a job failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Failure {
    /// The request is no sensible job.
    Request = 1,
    /// Memory ran out.
    Memory = 2,
    /// TetGen found an internal error.
    Internal = 3,
    /// TetGen found intersecting facets.
    Intersection = 4,
    /// TetGen found a feature that is too small for it, or facets too close.
    TooSmall = 5,
    /// TetGen found the input wrong.
    Input = 6,
    /// Anything else.
    Other = 7,
}

impl Fault {
    fn code(self) -> u8 {
        match self {
            Fault::Crash => 1,
            Fault::Hang => 2,
            Fault::Hog => 3,
            Fault::Garble => 4,
            Fault::Greet => 5,
            Fault::Invent => 6,
            Fault::Fail(failure) => FAIL | failure as u8,
        }
    }

    fn from_code(code: u8) -> Result<Self, Error> {
        Ok(match code {
            1 => Fault::Crash,
            2 => Fault::Hang,
            3 => Fault::Hog,
            4 => Fault::Garble,
            5 => Fault::Greet,
            6 => Fault::Invent,
            FAIL.. => Fault::Fail(Failure::from_code(code & !FAIL)?),
            _ => return Err(Error::Malformed("unknown fault")),
        })
    }
}

impl Failure {
    /// All failures.
    pub const ALL: [Failure; 7] = [
        Failure::Request,
        Failure::Memory,
        Failure::Internal,
        Failure::Intersection,
        Failure::TooSmall,
        Failure::Input,
        Failure::Other,
    ];

    fn from_code(code: u8) -> Result<Self, Error> {
        let found = Self::ALL.into_iter().find(|failure| *failure as u8 == code);
        found.ok_or(Error::Malformed("unknown failure"))
    }
}

impl Request {
    /// The message's bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        match self {
            Request::Job(job) => {
                let size = 32 + job.switches.len() + 24 * job.points.len();
                let mut to = Vec::with_capacity(size + 12 * job.triangles.len() + 16 * job.quads.len());
                to.push(1);
                put_text(&mut to, &job.switches);
                put_rows(&mut to, &job.points, f64::to_le_bytes);
                put_rows(&mut to, &job.triangles, u32::to_le_bytes);
                put_rows(&mut to, &job.quads, u32::to_le_bytes);
                to
            }
            Request::Fault(fault) => vec![2, fault.code()],
        }
    }

    /// The message of the bytes.
    ///
    /// # Errors
    /// [`Error::Malformed`] for anything but one whole message; indices are checked against
    /// `points`.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let mut from = Reader(bytes);
        let request = match from.byte()? {
            1 => {
                let job = Job {
                    switches: from.text()?,
                    points: from.rows(f64::from_le_bytes)?,
                    triangles: from.rows(u32::from_le_bytes)?,
                    quads: from.rows(u32::from_le_bytes)?,
                };
                let points = job.points.len();
                let indices = job.triangles.as_flattened().iter().chain(job.quads.as_flattened());
                if indices.clone().any(|&i| i as usize >= points) {
                    return Err(Error::Malformed("a facet names a point that is not there"));
                }
                if job.switches.contains('\0') {
                    return Err(Error::Malformed("NUL within the switches"));
                }
                Request::Job(job)
            }
            2 => Request::Fault(Fault::from_code(from.byte()?)?),
            _ => return Err(Error::Malformed("unknown request")),
        };
        from.end()?;
        Ok(request)
    }
}

impl Reply {
    /// The message's bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut to = Vec::new();
        match self {
            Reply::Hello { protocol, tetgen } => {
                to.push(1);
                to.extend(protocol.to_le_bytes());
                put_text(&mut to, tetgen);
            }
            Reply::Done(done) => {
                to.reserve_exact(9 + 24 * done.points.len() + 16 * done.tets.len());
                to.push(2);
                put_rows(&mut to, &done.points, f64::to_le_bytes);
                put_rows(&mut to, &done.tets, u32::to_le_bytes);
            }
            Reply::Failed { failure, text } => {
                to.push(3);
                to.push(*failure as u8);
                put_text(&mut to, text);
            }
        }
        to
    }

    /// The message of the bytes.
    ///
    /// # Errors
    /// [`Error::Malformed`] for anything but one whole message; indices are checked against
    /// `points`.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let mut from = Reader(bytes);
        let reply = match from.byte()? {
            1 => Reply::Hello { protocol: u32::from_le_bytes(from.take()?), tetgen: from.text()? },
            2 => {
                let points = from.rows(f64::from_le_bytes)?;
                let tets: Vec<[u32; 4]> = from.rows(u32::from_le_bytes)?;
                if tets.as_flattened().iter().any(|&i| i as usize >= points.len()) {
                    return Err(Error::Malformed("a tetrahedron names a point that is not there"));
                }
                Reply::Done(Tetrahedra { points, tets })
            }
            3 => {
                let failure = Failure::from_code(from.byte()?)?;
                Reply::Failed { failure, text: from.text()? }
            }
            _ => return Err(Error::Malformed("unknown reply")),
        };
        from.end()?;
        Ok(reply)
    }
}

fn put_text(to: &mut Vec<u8>, text: &str) {
    to.extend((text.len() as u32).to_le_bytes());
    to.extend(text.as_bytes());
}

fn put_rows<T: Copy, const N: usize, const B: usize>(
    to: &mut Vec<u8>,
    rows: &[[T; N]],
    bytes: fn(T) -> [u8; B],
) {
    to.extend((rows.len() as u32).to_le_bytes());
    for &value in rows.as_flattened() {
        to.extend(bytes(value));
    }
}

/// Takes values from the front of the bytes that are left.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const B: usize>(&mut self) -> Result<[u8; B], Error> {
        let (head, tail) = self.0.split_first_chunk::<B>().ok_or(Error::Malformed("it ends early"))?;
        self.0 = tail;
        Ok(*head)
    }
    fn byte(&mut self) -> Result<u8, Error> {
        self.take::<1>().map(|b| b[0])
    }
    /// A count of elements of `bytes` each, which must all be there.
    fn count(&mut self, bytes: usize) -> Result<usize, Error> {
        let count = u32::from_le_bytes(self.take()?) as usize;
        if count > self.0.len() / bytes {
            return Err(Error::Malformed("a count exceeds the frame"));
        }
        Ok(count)
    }
    fn text(&mut self) -> Result<String, Error> {
        let (head, tail) = {
            let count = self.count(1)?;
            self.0.split_at(count)
        };
        self.0 = tail;
        String::from_utf8(head.to_vec()).map_err(|_| Error::Malformed("text is not UTF-8"))
    }
    fn rows<T, const N: usize, const B: usize>(
        &mut self,
        value: fn([u8; B]) -> T,
    ) -> Result<Vec<[T; N]>, Error> {
        let count = self.count(N * B)?;
        let (head, tail) = self.0.split_at(count * N * B);
        self.0 = tail;
        let (values, _) = head.as_chunks::<B>();
        let (rows, _) = values.as_chunks::<N>();
        Ok(rows.iter().map(|row| row.map(value)).collect())
    }
    fn end(&self) -> Result<(), Error> {
        if self.0.is_empty() { Ok(()) } else { Err(Error::Malformed("bytes after the message")) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn requests() -> Vec<Request> {
        let faults = [Fault::Crash, Fault::Hang, Fault::Hog, Fault::Garble, Fault::Greet, Fault::Invent];
        let faults = faults.into_iter().chain(Failure::ALL.map(Fault::Fail)).map(Request::Fault);
        let jobs = vec![
            Request::Job(Job::default()),
            Request::Job(Job {
                switches: "pzQ".into(),
                points: vec![[0.0, -0.0, 1e-300], [f64::MAX, 1.5, 2.5], [3.0; 3], [4.0; 3]],
                triangles: vec![[0, 1, 2], [2, 1, 3]],
                quads: vec![[0, 1, 2, 3]],
            }),
        ];
        jobs.into_iter().chain(faults).collect()
    }

    fn replies() -> Vec<Reply> {
        let mut all = vec![
            Reply::Hello { protocol: PROTOCOL, tetgen: "1.5".into() },
            Reply::Done(Tetrahedra::default()),
            Reply::Done(Tetrahedra { points: vec![[0.5; 3]; 5], tets: vec![[0, 1, 2, 3], [4, 1, 2, 3]] }),
        ];
        all.extend(Failure::ALL.map(|failure| Reply::Failed { failure, text: "päng".into() }));
        all
    }

    #[test]
    fn messages_come_back_as_sent() {
        for request in requests() {
            assert_eq!(Request::from_bytes(&request.to_bytes()).unwrap(), request);
        }
        for reply in replies() {
            assert_eq!(Reply::from_bytes(&reply.to_bytes()).unwrap(), reply);
        }
    }

    #[test]
    fn every_truncation_and_extension_is_refused() {
        let all = requests().into_iter().map(|r| (r.to_bytes(), true));
        for (bytes, request) in all.chain(replies().into_iter().map(|r| (r.to_bytes(), false))) {
            let refused = |b: &[u8]| {
                if request { Request::from_bytes(b).is_err() } else { Reply::from_bytes(b).is_err() }
            };
            for length in 0..bytes.len() {
                assert!(refused(&bytes[..length]));
            }
            assert!(refused(&[&bytes[..], &[0]].concat()));
        }
    }

    #[test]
    fn changed_and_random_bytes_never_panic() {
        let mut random = bth_random::Rng::new(1);
        let mut below = |n: usize| random.below(n as u64) as usize;
        let seeds: Vec<Vec<u8>> = requests().iter().map(Request::to_bytes).collect();
        let seeds: Vec<Vec<u8>> = seeds.into_iter().chain(replies().iter().map(Reply::to_bytes)).collect();
        for _ in 0..20_000 {
            let mut bytes = seeds[below(seeds.len())].clone();
            for _ in 0..1 + below(4) {
                let at = below(bytes.len());
                bytes[at] = [0, 1, 0x7f, 0xff, below(256) as u8][below(5)];
            }
            // A message that is accepted must encode to the same bytes.
            if let Ok(request) = Request::from_bytes(&bytes) {
                assert_eq!(request.to_bytes(), bytes);
            }
            if let Ok(reply) = Reply::from_bytes(&bytes) {
                assert_eq!(reply.to_bytes(), bytes);
            }
        }
    }

    #[test]
    fn rejects_facets_and_tetrahedra_of_missing_points() {
        let job = Job { points: vec![[0.0; 3]; 3], triangles: vec![[0, 1, 3]], ..Job::default() };
        assert!(matches!(Request::from_bytes(&Request::Job(job).to_bytes()), Err(Error::Malformed(_))));
        let done = Tetrahedra { points: vec![[0.0; 3]; 3], tets: vec![[0, 1, 2, 3]] };
        assert!(matches!(Reply::from_bytes(&Reply::Done(done).to_bytes()), Err(Error::Malformed(_))));
    }
}

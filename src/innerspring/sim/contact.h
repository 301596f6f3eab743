#pragma once
#include <bit>
#include <limits>

#include "innerspring/sim/contact_trees.h"
#include "innerspring/sim/forces.h"

namespace innerspring {

/// What a tool felt in a step of dt, mean over the step.
struct ToolContact {
    Vector force = Vector::Zero();  ///< on the tool [N]
    Vector torque =
        Vector::Zero();  ///< on the tool, about its own origin [N m]; arms as they are before each sub-step
    int points = 0;      ///< where it pressed in the last sub-step
};

/// What all tools did to a vertex in a step of dt, mean over the step.
struct VertexContact {
    Index vertex = no_index;
    Vector force = Vector::Zero();  ///< on the vertex [N]
    double normal = 0;              ///< the part of it that is pressure [N]
};

struct ContactReport {
    std::vector<ToolContact> tools;       ///< one per tool, in the order of the loads
    std::vector<VertexContact> vertices;  ///< those that were pressed; their forces and the tools' sum to 0
    double work = 0;                      ///< at most what the tools put into the body [J]
    std::size_t looked_at =
        0;  ///< pairs of a vertex or a face and a part of a tool that may meet in the step
};

/// Pressure on a vertex [Pa]: the normal force over A_i at rest.
double pressure(const Body& body, const VertexContact& contact);

/// A vertex that a tool may meet in this step of dt. The caller fills in x and v in each sub-step.
struct Candidate {
    Index vertex;
    bool changed = false;     ///< by resolve(): x and v are to be taken back
    double inverse_mass = 0;  ///< [1/kg]; 0: pinned
    Vector x, v;              ///< in: x before the sub-step, v after it; out: both after it
    Vector start;             ///< x at the start of the step of dt
    Vector free_v;            ///< scratch of press_against_tools()
    /// Of a free body: what the tools give it before the damping is known [m/s]. It is part of the motion
    /// that is damped, and then found anew.
    Vector foreseen = Vector::Zero();
    Vector impulse = Vector::Zero();  ///< by all tools in this step of dt [N s]
    double normal = 0;                ///< its normal part [N s]
    Index at = no_index;              ///< its place
    Vector home;                      ///< at rest [m]
    Index use = no_index;             ///< scratch
};

/// Contact between a body and tools without a stiffness to choose (ours). A vertex whose next position would
/// lie in a tool is brought to the tool's surface: for the plane n . (x - p) = 0 that touches it there,
///     n . v' >= n . (p - x) / h,   or n . v_tool if the vertex already touched,
/// by an impulse j_n n >= 0, with Coulomb friction |j_t| <= mu j_n against the velocity along the surface.
/// Where triangles are large beside the tool (a side longer than a quarter of the radius, of the corner's or
/// side's of a mesh) the same holds for points of a face, x = sum_k w_k x_k, against balls in the tool (its
/// probes), the impulse acting on the corners by w_k. One vertex at one tool is solved at once, all else by
/// sweeps of projected Gauss-Seidel in fixed order, with conjugate directions between them.
///
/// The force is impulse over time: that on the tools is minus the sum of those on the vertices, and at rest
/// it is what the springs pull with. Nothing is kept from one step to the next, so that State says all. Paths
/// are swept: neither vertex nor probe passes through the other in one sub-step. What is inside a tool from
/// the beginning is put out at a bounded speed. The work of a step is bounded.
class Contact {
  public:
    /// Bounds over the whole body: how far it is from home and how fast, at the start of a step.
    struct Motion {
        double displacement = 0;  ///< |x_i - h_i| [m]
        double speed = 0;         ///< |v_i| [m/s]
        double share = 0.05;      ///< of the displacement, that springs may set free within the step
        HomeFrame frame;
        bool alone = false;  ///< resolve() will be called: vertices that nothing couples need no Candidate
    };

    /// Where a vertex is before a sub-step, and its velocity after it.
    struct Carried {
        Vector x, v;  ///< [m], [m/s]
    };

    /// Where a tool may press: n . v' >= least there.
    struct Point {
        std::array<Index, 3> corners;  ///< candidates
        std::array<double, 3> weights;
        int count;  ///< of corners
        Index tool;
        Vector x;                          ///< before the sub-step
        Vector normal, surface, velocity;  ///< of the tool where it ends
        double least = 0;                  ///< n . v' is at least this [m/s]
        double inverse_mass = 0, jn = 0;
        Vector jt = Vector::Zero();
        double radius = 0;                ///< of the ball that a face or side lies on [m]
        bool sticks = false;              ///< friction holds it
        bool fresh = true, known = true;  ///< of press(): new; whether jn is known well enough for friction
    };

    /// Follows a change of the body's mesh, at its own cost.
    void adapt(const Body& body, const SurfaceChange& surface, const BodyChange& change);

    /// Before a step of dt [s] in sub-steps of h [s]: finds the candidates. `stiffness` [1/s^2] bounds how
    /// the springs accelerate them; x_of(vertex) is its position [m]. Costs as much as there is near the
    /// tools. `places`: of the vertices, for resolve(); none: the vertices themselves.
    template <class PositionOf>
    void begin(const Body& body, const Loads& loads, const Motion& motion, double stiffness, double time,
               double dt, double h, std::span<const Index> places, PositionOf&& x_of) {
        find(body, loads, motion, stiffness, time, dt, h);
        x_.clear();
        for (const auto& [vertex, tool] : found_) x_.push_back(x_of(vertex));
        for (const auto& [triangle, tool] : found_faces_)
            for (Index corner : body.rest.triangles[triangle]) x_.push_back(x_of(corner));
        narrow(body, loads, motion.alone, places);
    }

    std::vector<Candidate>& candidates() { return candidates_; }

    /// One sub-step from `time` to time + h on the candidates, and on the vertices that only one tool may
    /// meet. The caller says with look(home, place) where a vertex is, home its position at rest [m], and
    /// takes with give(home, place, carried) what the tools made of it.
    template <class Look, class Give>
    void resolve(const Loads& loads, double time, double h, Look&& look, Give&& give) {
        place_tools(loads, time, h);
        for (std::size_t first = 0, count; first < lones_.size(); first += count) {
            count = next_lones(first);
            const Lone* const lones = &lones_[first];
            for (std::size_t n = 0; n < count; ++n) carried_[n] = look(lones[n].home, lones[n].place);
            press_alone(loads.tools[lones->tool], first, count, h);
            for (std::size_t n = 0; n < count; ++n)
                if (pressed_[n]) give(lones[n].home, lones[n].place, carried_[n]);
        }
        if (candidates_.empty()) return;
        for (Candidate& c : candidates_) {
            const Carried at = look(c.home, c.at);
            c.x = at.x, c.v = at.v;
        }
        resolve_coupled(loads, time, h);
        for (const Candidate& c : candidates_)
            if (c.changed) give(c.home, c.at, {c.x, c.v});
    }

    /// Its parts: finds where something would get into a tool, false if nowhere; finds the impulses, or more
    /// of them if the velocities were changed since; takes them over.
    bool meet_all(const Loads& loads, double time, double h);
    void settle(const Loads& loads);
    void finish(double h);

    /// The parts of a sub-step for those that solve for the body themselves, in their order. `inverse_mass`
    /// of the candidates is then that of a vertex whose neighbours stay. `approach` adds points for what on
    /// its way from x to x + h v gets to a tool, and says whether there are more than before; points stay
    /// until `open`. `press` finds the impulses that the v it is given need, and the v after them. `close`
    /// books the impulses of a step that ends at x with v, and puts out what is inside, by x.
    void open(const Loads& loads, double time, double h);
    bool approach(const Loads& loads, double h);
    /// Friction waits until a point was pressed on in the call before, or touched at the start: false if it
    /// does.
    bool press(const Loads& loads);
    void close();
    std::span<const Point> points() const { return points_; }

    /// After the step of dt: the report.
    void end(double dt);
    const ContactReport& report() const { return report_; }

  private:
    struct Placed {
        Eigen::Matrix3d R;
        Vector t;
        Vector local(const Vector& x) const { return R.transpose() * (x - t); }
        Vector world(const Vector& x) const { return R * x + t; }
    };
    struct ToolData {
        const void* key = nullptr;  ///< the mesh the probes are of
        double radius = -1, length = -1, spacing = 0;
        Probes probes;
        BoxTree probe_tree;
        double fine_side = 0;         ///< the least of the probes' [m]
        std::vector<double> nearest;  ///< per probe: to the large faces at the start of the step [m]
        double bound = 0;             ///< of the ball about the origin that holds the tool [m]
        double sweep = 0;             ///< how far its points move in this step [m]
        double turn = 0;              ///< the angle [1]
        bool still = false;           ///< does not move in this step
        Placed start, now, next;      ///< at the start of the step, before and after the sub-step
        Placed back;                  ///< from after the sub-step to before
    };
    struct Seen {
        Index vertex, tool;
        bool exact;       ///< else the distance is at least
        Vector local;     ///< in the tool's frame [m]
        double distance;  ///< [m]
        NearTriangles few;
    };
    struct Near {  ///< a vertex near a tool at the start of the step
        Index tool;
        Index seen;       ///< of a mesh
        double distance;  ///< [m]
        Vector local;     ///< where it is in the tool's frame
    };
    struct VertexPair : Near {
        Index candidate;
        bool met = false;
    };
    /// A vertex that no other tool and no face may meet: all of it is done in one place.
    struct Lone : Near {
        Index vertex, place;
        double mass, inverse_mass;        ///< [kg], [1/kg]
        Vector home;                      ///< at rest [m]
        Vector impulse = Vector::Zero();  ///< in this step of dt [N s]
        Vector torque = Vector::Zero();   ///< of it about the tool's origin [N m s]
        double normal = 0;                ///< its normal part [N s]
        double work = 0;                  ///< as ContactReport::work [J]
    };
    struct Met {
        Vector normal, surface;  ///< of the tool after the sub-step
        bool touching;           ///< before it
    };
    struct FacePair {
        std::array<Index, 6> corners;  ///< candidates; the last three lie across the sides
        Index tool, probe;
        double distance;  ///< between face and ball at the start of the step [m]
        double deep;      ///< below the face by more than this [m] it stays where it is
        bool met = false;
    };
    struct Close {
        Index face, probe;  ///< among the found ones
        double distance;    ///< [m]
    };
    struct Steps {
        Vector change = Vector::Zero(), direction = Vector::Zero();  ///< of a point's impulse
    };
    static Placed placed(const Tool& tool, double time);
    static Placed placed(const Pose& pose);
    void prepare(const Body& body, const Loads& loads, double time, double dt);
    void find(const Body& body, const Loads& loads, const Motion& motion, double stiffness, double time,
              double dt, double h);
    void reserve(std::size_t vertices);
    void mark(Index item) {
        const std::size_t word = item / 64;
        if (word >= marks_.size()) marks_.resize(word + 1);
        marks_[word] |= std::uint64_t(1) << (item % 64);
        first_mark_ = std::min(first_mark_, word), last_mark_ = std::max(last_mark_, word);
    }
    /// In the order of their numbers, whatever way the trees came to be as they are.
    template <class Take>
    void take_marked(Take&& take) {
        for (; first_mark_ <= last_mark_; ++first_mark_)
            for (std::uint64_t& bits = marks_[first_mark_]; bits != 0; bits &= bits - 1)
                take(Index(64 * first_mark_) + Index(std::countr_zero(bits)));
        first_mark_ = std::numeric_limits<std::size_t>::max(), last_mark_ = 0;
    }
    void narrow(const Body& body, const Loads& loads, bool alone, std::span<const Index> places);
    void narrow_faces(const Body& body);
    bool find_close(double reach);
    double to_mesh(const DistanceField& mesh, Index i, Index tool, const Vector& local, double near);
    double mass(const Body& body, Index vertex) const;
    Index candidate(const Body& body, Index vertex);
    void place_tools(const Loads& loads, double time, double h);
    std::size_t next_lones(std::size_t first) const;
    void press_alone(const Tool& tool, std::size_t first, std::size_t count, double h);
    template <class Meet>
    void press_each(const Tool& tool, std::size_t first, std::size_t count, double h, Meet&& meet);
    void report_lones(double dt);
    void resolve_coupled(const Loads& loads, double time, double h);
    bool meet(const Tool& tool, const Near& near, const Carried& c, double h, Met& met);
    void meet(const Tool& tool, const VertexPair& pair, double h);
    void meet(const FacePair& pair, double h);
    Carried mean(const Point& point) const;
    double left_inside(const Point& point, const Vector& x) const;
    void book(const Point& point, const Vector& arm, double work, double depth);
    void add(Point& point, bool touching, double h);
    void apply(Point& point, const Vector& impulse);
    void relax(Point& point, double friction);

    ContactTrees trees_;
    std::vector<std::uint64_t> marks_;  ///< a bit per vertex or triangle, none between calls
    std::size_t first_mark_ = std::numeric_limits<std::size_t>::max(), last_mark_ = 0;  ///< words
    std::vector<std::array<Index, 2>> found_;                                           ///< (vertex, tool)
    std::vector<std::array<Index, 2>> found_faces_;                                     ///< (triangle, tool)
    std::vector<Vector> x_;                 ///< of those, then of the corners of these [m]
    std::vector<Index> candidate_of_;       ///< per vertex
    std::vector<bool> pinned_;              ///< per vertex
    std::vector<Seen> seen_, seen_before_;  ///< of meshes: in this step and the one before
    std::vector<Index> seen_of_;            ///< per vertex: where in there it is, or was
    std::vector<Candidate> candidates_;
    std::vector<ToolData> tools_;
    std::vector<VertexPair> pairs_;
    std::vector<Lone> lones_;     ///< those of a tool together, in the order of their places
    std::vector<Index> pair_at_;  ///< per place: scratch
    static constexpr std::size_t most_at_once = 32;
    std::array<Carried, most_at_once> carried_;
    std::array<bool, most_at_once> pressed_{};
    std::vector<FacePair> faces_;
    std::vector<Point> points_;
    std::vector<Steps> steps_;  ///< per point
    bool long_ = false;  ///< steps so long that springs take vertices far: planes where they are, not go
    double touch_ = 0;   ///< nearer than this is touching: rounding of positions [m]
    /// How far a vertex is taken to move in this step: twice what the fastest does and a share of what
    /// springs could set free [m]. What goes farther into a tool is put out in the next step.
    double reach_ = 0;
    double h_ = 0, put_out_ = 0;  ///< [s]; how far what is inside a tool moves in a sub-step [m]
    std::vector<Close> close_;
    std::size_t probes_ = 0, looks_left_ = 0;  ///< of all tools; that a step may still take
    double stiffness_ = 0, displacement_ = 0, last_time_ = 0;
    ContactReport report_;
};

}  // namespace innerspring

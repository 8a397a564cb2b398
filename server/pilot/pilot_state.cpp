// A pilot written down, and read again: pilot_state.proto.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "server/pilot/pilot.h"
#include "server/pilot/pilot_state.pb.h"

namespace gatefield::pilot {
namespace {

/// Raised whenever a field's meaning changes: a state of another format is refused.
constexpr std::uint32_t kStateFormat = 5;
/// States kept for frames still to come: a quarter of a second at 500 Hz. Older ones than these a frame is refused for.
constexpr std::size_t kMaxHistory = 128;
constexpr std::size_t kCommandNumbers = 12;  // of a step

using Doubles = google::protobuf::RepeatedField<double>;

// ---- writing --------------------------------------------------------------------------------------------------------

template <typename Matrix>
void put(const Eigen::DenseBase<Matrix>& values, Doubles* out) {
  for (Eigen::Index row = 0; row < values.rows(); ++row)
    for (Eigen::Index column = 0; column < values.cols(); ++column) out->Add(values.derived().coeff(row, column));
}

void put(const Eigen::Quaterniond& q, Doubles* out) {
  for (const double value : {q.w(), q.x(), q.y(), q.z()}) out->Add(value);
}

void put(const Eigen::Isometry3d& X, Doubles* out) { put(X.matrix().topRows<3>(), out); }

void put(const QuadrotorState& state, proto::Vehicle* out) {
  put(state.p_WB, out->mutable_p_wb());
  put(state.v_WB, out->mutable_v_wb());
  put(state.w_WB_B, out->mutable_w_wb_b());
  put(state.q_WB, out->mutable_q_wb());
  put(state.thrust_n, out->mutable_thrust_n());
  put(state.thrust_command_n, out->mutable_thrust_command_n());
}

void put(const TimeLine::Point& point, proto::Point* out) {
  out->set_sequence(point.sequence);
  out->set_stamp(point.stamp.count());
  out->set_received(point.received.count());
}

void put(const Intake::Line& line, proto::TimeLine* out) {
  const TimeLine::State& order = line.order.state();
  out->set_begun(order.begun);
  put(order.newest, out->mutable_newest());
  put(order.elsewhere, out->mutable_elsewhere());
  out->set_agreeing(order.agreeing);
  out->set_number(line.number);
}

/// Of a StateHistory::Entry or MotionLine::Point: p_WB, v_WB, w_WB_B, q_WB.
template <typename Place>
void put_pose(const Place& place, Doubles* out) {
  put(place.p_WB, out);
  put(place.v_WB, out);
  put(place.w_WB_B, out);
  put(place.q_WB, out);
}

void put(const MotionLine::Point& point, proto::Place* out) {
  out->set_stamp(point.stamp.count());
  out->set_received(point.received.count());
  put_pose(point, out->mutable_pose());
}

void put(const MotionLine::State& motion, proto::MotionLine* out) {
  if (motion.begun) put(motion.newest, out->mutable_newest());
  if (motion.agreeing > 0) put(motion.elsewhere, out->mutable_elsewhere());
  out->set_agreeing(motion.agreeing);
  out->set_jumps(motion.jumps);
}

void put(const protocol::Asked& asked, proto::Asked* out) {
  out->set_by(static_cast<std::uint32_t>(asked.by));
  put(asked.command, out->mutable_command());
}

void put(const StateSample& sample, proto::Sample* out) {
  out->set_sequence(sample.sequence);
  out->set_stamp(sample.stamp.count());
  out->set_line(sample.line);
  out->set_jumps(sample.jumps);
  out->set_received(sample.received.count());
  put(sample.state, out->mutable_state());
  out->set_thrust_known(sample.thrust_known);
  out->set_round_trip(sample.round_trip.count());
  out->set_depth_sequence(sample.depth_sequence);
  out->set_heard_waypoint(sample.heard_waypoint);
  out->set_heard_lap(sample.heard_lap);
  put(sample.asked, out->mutable_asked());
}

void put(const DelayEstimate::Mean& mean, proto::Mean* out) {
  out->set_value(mean.value);
  out->set_deviation(mean.deviation);
  out->set_count(mean.count);
}

void put(const gates::GateBelief& belief, proto::Belief* out) {
  put(belief.center_W, out->mutable_center_w());
  put(belief.axis_W, out->mutable_axis_w());
  out->set_seen(belief.seen);
  out->set_center_sigma_m(belief.center_sigma_m);
  out->set_axis_sigma_rad(belief.axis_sigma_rad);
  out->set_opening(static_cast<std::uint32_t>(belief.shape.opening));
  for (const double value : {belief.shape.inner_half_m, belief.shape.outer_half_m, belief.shape.thickness_m})
    out->add_shape(value);
}

void put(const gates::GateRecords::Record& record, const perception::GateSensor& sensor, proto::Gate* out) {
  const gates::RememberedGate& gate = record.gate;
  if (!gate.seen) return;  // as the course has it
  out->set_seen(true);
  out->set_stamp(gate.stamp.count());
  put(gate.center_W, out->mutable_center_w());
  put(gate.axis_W, out->mutable_axis_w());
  out->set_center_sigma_m(gate.center_sigma_m);
  out->set_axis_sigma_rad(gate.axis_sigma_rad);
  if (gate.field) {
    const perception::FieldSource source = sensor.source_of(*gate.field);
    put(source.X_WF, out->mutable_x_wf());
    out->mutable_latent()->Add(source.latent.begin(), source.latent.end());
  }
  const gates::GateEstimate::State& estimate = record.estimate.state();
  proto::Estimate* const filter = out->mutable_estimate();
  filter->set_started(estimate.started);
  filter->set_votes(estimate.votes);
  filter->set_stamp(estimate.stamp.count());
  put(estimate.X_WG, filter->mutable_x_wg());
  filter->set_center_variance_m2(estimate.center_variance_m2);
  filter->set_axis_variance_rad2(estimate.axis_variance_rad2);
  filter->set_outliers(estimate.outliers);
  put(estimate.outlier_center_W, filter->mutable_outlier_center_w());
  filter->set_from_afar(estimate.from_afar);
  filter->set_afar_stamp(estimate.afar_stamp.count());
  put(estimate.afar_center_W, filter->mutable_afar_center_w());
  put(estimate.afar_axis_W, filter->mutable_afar_axis_w());
}

void put(const protocol::ThrustRateCommand& command, proto::Command* out) {
  out->set_sequence(command.sequence);
  out->set_answers_sequence(command.answers_sequence);
  out->set_answers_stamp(command.answers_stamp.count());
  out->set_plan_start(command.plan_start.count());
  out->set_validity(command.validity.count());
  out->set_steps(static_cast<std::uint32_t>(command.steps));
  for (std::size_t k = 0; k < static_cast<std::size_t>(command.steps); ++k) {
    put(command.thrust_rate_n_s[k], out->mutable_values());
    put(command.rotor_thrust_n[k], out->mutable_values());
    out->add_values(command.collective_thrust_n[k]);
    put(command.body_rates_rad_s[k], out->mutable_values());
  }
  const protocol::PlannerHealth& health = command.health;
  for (const double value :
       {health.solve_time_s, health.effective_samples, health.lowest_field_m, health.latent_age_s, health.state_age_s})
    out->add_health(value);
  out->set_target_waypoint(health.target_waypoint);
  out->set_lap(health.lap);
  out->set_course_done(health.course_done);
  out->set_degraded(health.degraded);
  out->set_problems(health.problems);
}

void put(const Stepping::State& state, proto::Stepping* out) {
  put(state.newest, out->mutable_newest());
  out->set_line(state.line);
  out->set_jumps(state.jumps);
  out->set_have_state(state.have_state);
  out->set_state_is_new(state.state_is_new);
  out->set_have_rotors(state.have_rotors);
  put(state.rotors, out->mutable_rotors());
  out->set_rotors_stamp(state.rotors_stamp.count());
  out->set_first_stamp(state.first_stamp.count());
  // Nothing is predicted from before these any more.
  Stamp needed = std::min(state.newest.stamp, state.rotors_stamp);
  if (state.measured_stamp >= Stamp{0}) needed = std::min(needed, state.measured_stamp);
  for (const InputTimeline::Piece& piece : state.inputs.pieces(needed)) {
    proto::Piece* const to = out->add_inputs();
    to->set_from(piece.from.count());
    to->set_length((piece.to - piece.from).count());
    put(piece.input, to->mutable_rates_n_s());
  }
  put(state.inputs.told().asked, out->mutable_told());
  out->set_plan_resumes(state.inputs.told().plan_resumes.count());
  put(state.delay.state().round_trip, out->mutable_round_trip());
  put(state.delay.state().residence, out->mutable_residence());
  put(state.delay.state().solve, out->mutable_solve());
  out->set_delay_known(state.delay_known);
  put(state.disturbance.acceleration_W_m_s2(), out->mutable_disturbance_w_m_s2());
  out->set_thrust_factor(state.thrust_factor.state().factor);
  out->set_thrust_observed(state.thrust_factor.state().observed.count());
  put(state.measured, out->mutable_measured());
  out->set_measured_stamp(state.measured_stamp.count());
  if (state.have_passed) put(state.passed, out->mutable_passed());
  out->set_steps_made(state.steps_made);
  out->set_have_plan(state.have_plan);
  out->set_last_plan_start(state.last_plan_start.count());
  out->set_holding(state.holding);
  if (state.holding) put(state.hold, out->mutable_hold());
  put(state.command, out->mutable_command());
  out->set_command_good(state.command_good);
  out->set_first_answer(state.first_answer);
}

void put(const gates::CourseProgress::State& progress, proto::Progress* out) {
  out->set_target(progress.target);
  out->set_lap(progress.lap);
  out->set_done(progress.done);
  out->set_has_previous(progress.has_previous);
  out->set_resumed(progress.resumed);
  put(progress.previous_p_WB, out->mutable_previous_p_wb());
  if (!progress.has_before) return;
  put(progress.before_center_W, out->mutable_before_center_w());
  put(progress.before_axis_W, out->mutable_before_axis_w());
}

// ---- reading --------------------------------------------------------------------------------------------------------

/// Remembers the first thing that was wrong; what is read after it does not matter.
class Reader {
 public:
  void get(const Doubles& from, std::size_t count, double* to, const char* field) {
    if (from.size() != static_cast<int>(count))
      return fail(field, std::to_string(from.size()) + " numbers", std::to_string(count));
    for (int i = 0; i < from.size(); ++i) {
      if (!std::isfinite(from[i])) fail(field, "not finite", "finite numbers");
      to[i] = from[i];
    }
  }
  template <int kRows, int kOptions>
  void get(const Doubles& from, Eigen::Matrix<double, kRows, 1, kOptions>* to, const char* field) {
    get(from, kRows, to->data(), field);
  }
  void get(const Doubles& from, PlainQuaternion* to, const char* field) {
    double wxyz[4] = {1, 0, 0, 0};
    get(from, 4, wxyz, field);
    *to = PlainQuaternion(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    check_unit(*to, field);
  }
  void get(const Doubles& from, Eigen::Isometry3d* to, const char* field) {
    Eigen::Matrix<double, 3, 4, Eigen::RowMajor> rows = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>::Zero();
    get(from, 12, rows.data(), field);
    to->setIdentity();
    to->matrix().topRows<3>() = rows;
  }
  void get(const proto::Vehicle& from, QuadrotorState* to, const char* field) {
    get(from.p_wb(), &to->p_WB, field);
    get(from.v_wb(), &to->v_WB, field);
    get(from.w_wb_b(), &to->w_WB_B, field);
    get(from.q_wb(), &to->q_WB, field);
    get(from.thrust_n(), &to->thrust_n, field);
    get(from.thrust_command_n(), &to->thrust_command_n, field);
  }
  template <typename Place>
  void get_pose(const Doubles& from, Place* to, const char* field) {
    double pose[13] = {};
    get(from, 13, pose, field);
    to->p_WB = Eigen::Map<const Eigen::Vector3d>(pose);
    to->v_WB = Eigen::Map<const Eigen::Vector3d>(pose + 3);
    to->w_WB_B = Eigen::Map<const Eigen::Vector3d>(pose + 6);
    to->q_WB = Eigen::Quaterniond(pose[9], pose[10], pose[11], pose[12]);
    check_unit(to->q_WB, field);
  }
  void get(const proto::Place& from, std::chrono::nanoseconds clock_ahead, MotionLine::Point* to) {
    to->stamp = Stamp{from.stamp()};
    if (from.stamp() < 0 || to->stamp > TimeLine::kMaxStamp)
      fail("intake.motion.stamp", std::to_string(from.stamp()), "a time that a client's clock has");
    to->received = Stamp{from.received()} + clock_ahead;
    get_pose(from.pose(), to, "intake.motion.pose");
  }
  void get(const proto::MotionLine& from, std::chrono::nanoseconds clock_ahead, MotionLine::State* to) {
    to->begun = from.has_newest();
    if (from.has_newest()) get(from.newest(), clock_ahead, &to->newest);
    if (from.has_elsewhere()) get(from.elsewhere(), clock_ahead, &to->elsewhere);
    to->agreeing = from.agreeing();
    to->jumps = from.jumps();
  }
  static TimeLine::Point point(const proto::Point& from, std::chrono::nanoseconds clock_ahead) {
    return {from.sequence(), Stamp{from.stamp()}, Stamp{from.received()} + clock_ahead};
  }
  void get(const proto::TimeLine& from, std::chrono::nanoseconds clock_ahead, Intake::Line* to) {
    TimeLine::State order;
    order.begun = from.begun();
    order.newest = point(from.newest(), clock_ahead);
    order.elsewhere = point(from.elsewhere(), clock_ahead);
    order.agreeing = from.agreeing();
    to->order.restore(order);
    to->number = from.number();
  }
  void get(const proto::Asked& from, protocol::Asked* to, const char* field) {
    if (from.by() > static_cast<std::uint32_t>(protocol::AskedBy::kUnknown))
      return fail(field, std::to_string(from.by()), "0 to 3");
    to->by = static_cast<protocol::AskedBy>(from.by());
    get(from.command(), &to->command, field);
  }
  void get(const proto::Sample& from, std::chrono::nanoseconds clock_ahead, StateSample* to) {
    to->sequence = from.sequence();
    to->stamp = Stamp{from.stamp()};
    to->line = from.line();
    to->jumps = from.jumps();
    to->received = Stamp{from.received()} + clock_ahead;
    get(from.state(), &to->state, "stepping.newest.state");
    to->thrust_known = from.thrust_known();
    to->round_trip = Stamp{from.round_trip()};
    to->depth_sequence = from.depth_sequence();
    to->heard_waypoint = from.heard_waypoint();
    to->heard_lap = from.heard_lap();
    get(from.asked(), &to->asked, "stepping.newest.asked");
  }
  void get(const proto::Belief& from, gates::GateBelief* to, const char* field) {
    get(from.center_w(), &to->center_W, field);
    get(from.axis_w(), &to->axis_W, field);
    to->seen = from.seen();
    to->center_sigma_m = spread(from.center_sigma_m(), field);
    to->axis_sigma_rad = spread(from.axis_sigma_rad(), field);
    to->shape.opening = from.opening() == 0 ? GateShape::Opening::kSquare : GateShape::Opening::kRound;
    double shape[3] = {};
    get(from.shape(), 3, shape, field);
    to->shape.inner_half_m = shape[0];
    to->shape.outer_half_m = shape[1];
    to->shape.thickness_m = shape[2];
  }
  /// @param to  as the course has the gate
  void get(const proto::Gate& from, const GateShape& shape, perception::GateSensor* sensor,
           gates::GateRecords::Record* to) {
    if (!from.seen()) return;
    gates::RememberedGate& gate = to->gate;
    gate.seen = true;
    gate.stamp = Stamp{from.stamp()};
    get(from.center_w(), &gate.center_W, "looking.gates.center_W");
    get(from.axis_w(), &gate.axis_W, "looking.gates.axis_W");
    gate.center_sigma_m = spread(from.center_sigma_m(), "looking.gates.center_sigma_m");
    gate.axis_sigma_rad = spread(from.axis_sigma_rad(), "looking.gates.axis_sigma_rad");
    const proto::Estimate& filter = from.estimate();
    gates::GateEstimate::State estimate;
    estimate.started = filter.started();
    estimate.votes = filter.votes();
    estimate.stamp = Stamp{filter.stamp()};
    get(filter.x_wg(), &estimate.X_WG, "looking.gates.estimate.X_WG");
    estimate.center_variance_m2 = spread(filter.center_variance_m2(), "looking.gates.estimate.center_variance_m2");
    estimate.axis_variance_rad2 = spread(filter.axis_variance_rad2(), "looking.gates.estimate.axis_variance_rad2");
    estimate.outliers = filter.outliers();
    get(filter.outlier_center_w(), &estimate.outlier_center_W, "looking.gates.estimate.outlier_center_W");
    estimate.from_afar = filter.from_afar();
    estimate.afar_stamp = Stamp{filter.afar_stamp()};
    get(filter.afar_center_w(), &estimate.afar_center_W, "looking.gates.estimate.afar_center_W");
    get(filter.afar_axis_w(), &estimate.afar_axis_W, "looking.gates.estimate.afar_axis_W");
    to->estimate.restore(estimate);
    if (from.x_wf().empty() || !ok()) return;
    perception::FieldSource source;
    get(from.x_wf(), &source.X_WF, "looking.gates.X_WF");
    source.latent.assign(from.latent().begin(), from.latent().end());
    if (!std::all_of(source.latent.begin(), source.latent.end(), [](float x) { return std::isfinite(x); }))
      return fail("looking.gates.latent", "not finite", "finite numbers");
    auto field = sensor->restore(source, shape);
    if (!field) return fail(field.failure().within("looking.gates.", "looking.gates."));
    gate.field = std::move(field).value();
  }
  void get(const proto::Command& from, protocol::ThrustRateCommand* to) {
    if (from.steps() > static_cast<std::uint32_t>(protocol::kMaxPlanSteps))
      return fail("stepping.command.steps", std::to_string(from.steps()),
                  "at most " + std::to_string(protocol::kMaxPlanSteps));
    to->sequence = from.sequence();
    to->answers_sequence = from.answers_sequence();
    to->answers_stamp = Stamp{from.answers_stamp()};
    to->plan_start = Stamp{from.plan_start()};
    to->validity = Stamp{from.validity()};
    to->steps = static_cast<int>(from.steps());
    std::vector<double> values(from.steps() * kCommandNumbers);
    get(from.values(), values.size(), values.data(), "stepping.command.values");
    for (std::size_t k = 0; k < from.steps(); ++k) {
      const double* const at = values.data() + k * kCommandNumbers;
      to->thrust_rate_n_s[k] = Eigen::Map<const Eigen::Vector4d>(at);
      to->rotor_thrust_n[k] = Eigen::Map<const Eigen::Vector4d>(at + 4);
      to->collective_thrust_n[k] = at[8];
      to->body_rates_rad_s[k] = Eigen::Map<const Eigen::Vector3d>(at + 9);
    }
    double health[5] = {};
    get(from.health(), 5, health, "stepping.command.health");
    to->health.solve_time_s = health[0];
    to->health.effective_samples = health[1];
    to->health.lowest_field_m = health[2];
    to->health.latent_age_s = health[3];
    to->health.state_age_s = health[4];
    to->health.target_waypoint = from.target_waypoint();
    to->health.lap = from.lap();
    to->health.course_done = from.course_done();
    to->health.degraded = from.degraded();
    to->health.problems = from.problems();
  }
  /// @param to  of a new pilot
  void get(const proto::Stepping& from, std::chrono::nanoseconds clock_ahead, Stepping::State* to) {
    get(from.newest(), clock_ahead, &to->newest);
    to->line = from.line();
    to->jumps = from.jumps();
    to->have_state = from.have_state();
    to->state_is_new = from.state_is_new();
    to->have_rotors = from.have_rotors();
    get(from.rotors(), &to->rotors, "stepping.rotors");
    to->rotors_stamp = Stamp{from.rotors_stamp()};
    to->first_stamp = Stamp{from.first_stamp()};
    std::vector<InputTimeline::Piece> pieces;
    for (const proto::Piece& piece : from.inputs()) {
      // Before they are added up: of a damaged state the sum could leave 64 bits.
      if (Stamp{piece.from()} > TimeLine::kMaxStamp || Stamp{piece.length()} > TimeLine::kMaxStamp || piece.from() < 0)
        return fail("stepping.inputs", "beyond the stamps that there are", "at least 0 and at most 146 years");
      pieces.emplace_back();
      pieces.back().from = Stamp{piece.from()};
      pieces.back().to = Stamp{piece.from()} + Stamp{piece.length()};
      get(piece.rates_n_s(), &pieces.back().input, "stepping.inputs.rates_n_s");
    }
    if (!to->inputs.restore(pieces)) fail("stepping.inputs", "out of order", "pieces one after the other");
    InputTimeline::Told told;
    get(from.told(), &told.asked, "stepping.told");
    told.plan_resumes = Stamp{from.plan_resumes()};
    to->inputs.restore(told);
    const auto mean = [this](const proto::Mean& m) {
      if (!std::isfinite(m.value())) fail("stepping.delay", "not finite", "finite numbers");
      return DelayEstimate::Mean{m.value(), spread(m.deviation(), "stepping.delay"), m.count()};
    };
    to->delay.restore({mean(from.round_trip()), mean(from.residence()), mean(from.solve())});
    to->delay_known = from.delay_known();
    Eigen::Vector3d disturbance_W = Eigen::Vector3d::Zero();
    get(from.disturbance_w_m_s2(), &disturbance_W, "stepping.disturbance_W_m_s2");
    to->disturbance.restore(disturbance_W);
    to->thrust_factor.restore({from.thrust_factor(), Stamp{from.thrust_observed()}});
    get(from.measured(), &to->measured, "stepping.measured");
    to->measured_stamp = Stamp{from.measured_stamp()};
    to->have_passed = from.has_passed();
    if (from.has_passed()) get(from.passed(), &to->passed, "stepping.passed");
    to->steps_made = from.steps_made();
    to->have_plan = from.have_plan();
    to->last_plan_start = Stamp{from.last_plan_start()};
    to->holding = from.holding();
    if (from.has_hold()) get(from.hold(), &to->hold, "stepping.hold");
    get(from.command(), &to->command);
    to->command_good = from.command_good();
    to->first_answer = from.first_answer();
  }
  void get(const proto::Progress& from, gates::CourseProgress::State* to) {
    to->target = from.target();
    to->lap = from.lap();
    to->done = from.done();
    to->has_previous = from.has_previous();
    to->resumed = from.resumed();
    get(from.previous_p_wb(), &to->previous_p_WB, "stepping.progress.previous_p_WB");
    to->has_before = !from.before_center_w().empty();
    if (!to->has_before) return;
    get(from.before_center_w(), &to->before_center_W, "stepping.progress.before_center_W");
    get(from.before_axis_w(), &to->before_axis_W, "stepping.progress.before_axis_W");
  }
  void get(const proto::Intake& from, std::vector<StateHistory::Entry>* to) {
    for (const auto& entry : from.history()) {
      StateHistory::Entry at;
      at.stamp = Stamp{entry.stamp()};
      get_pose(entry.pose(), &at, "intake.history.pose");
      if (!to->empty() && at.stamp <= to->back().stamp) fail("intake.history", "out of order", "stamps that rise");
      to->push_back(at);
    }
  }

  /// A standard deviation or a variance, as it is.
  double spread(double value, const char* field) {
    if (!(std::isfinite(value) && value >= 0.0)) fail(field, std::to_string(value), "finite and at least 0");
    return value;
  }
  template <typename Quaternion>
  void check_unit(const Quaternion& q, const char* field) {
    if (!(std::abs(q.norm() - 1.0) <= 1e-3))
      fail(field, "a quaternion of norm " + std::to_string(q.norm()), "norm 1 within 1e-3");
  }
  /// @param index  of a waypoint, below `count`
  void check_waypoint(std::uint32_t index, std::uint32_t count, const char* field) {
    if (index >= count) fail(field, std::to_string(index), "below " + std::to_string(count));
  }
  void fail(const char* field, const std::string& value, const std::string& expected) {
    fail(Error::invalid(field, value, expected));
  }
  void fail(Error error) {
    if (status_.ok()) status_ = std::move(error);
  }
  bool ok() const noexcept { return status_.ok(); }
  const Status& status() const noexcept { return status_; }

 private:
  Status status_;
};

}  // namespace

std::string Pilot::save() {
  const Intake::State lines = intake_.state();  // before absorb(): a state that comes in between is no repeated one
  stepping_.absorb();
  proto::PilotState out;
  out.set_format(kStateFormat);
  out.set_model_hash(model_hash_);
  out.set_vehicle(request_.vehicle);
  out.set_session(session_);
  out.set_profile(request_.profile);
  out.set_timing(static_cast<std::uint32_t>(request_.timing));

  const std::uint64_t processed = shared_.frame_processed.load();
  const Stamp captured = std::max(looking_.newest_capture(), Stamp{0});
  proto::Intake* const intake = out.mutable_intake();
  put(lines.states, intake->mutable_states());
  put(lines.motion.state(), intake->mutable_motion());
  Intake::Line frames = lines.frames;
  TimeLine::State order = frames.order.state();
  if (order.newest.sequence != processed) {  // one waits
    order.begun = processed != 0;
    order.newest.sequence = processed;
    order.newest.stamp = captured;
  }
  frames.order.restore(order);
  put(frames, intake->mutable_frames());
  intake->set_last_heard(shared_.last_heard.load());
  intake->set_newest_state_rejected(shared_.newest_state_rejected.load());
  intake->set_repeat_wanted(shared_.repeat_wanted.load());
  intake->set_frame_named(shared_.frame_named.load());
  intake->set_frame_refused(shared_.frame_refused.load());
  for (const StateHistory::Entry& entry : shared_.history.entries(captured, kMaxHistory)) {
    auto* const to = intake->add_history();
    to->set_stamp(entry.stamp.count());
    put_pose(entry, to->mutable_pose());
  }

  proto::Looking* const looking = out.mutable_looking();
  looking->set_good_frame_stamp(shared_.good_frame_stamp.load());
  looking->set_good_frame_line(shared_.good_frame_line.load());
  looking->set_target(shared_.targets().target);
  looking->set_next(shared_.targets().next);
  looking->set_line(looking_.line());
  perception::Sight& sight = looking_.sight();
  for (const auto& record : sight.records().records()) put(record, sight.sensor(), looking->add_gates());

  proto::Stepping* const stepping = out.mutable_stepping();
  put(stepping_.state(), stepping);
  put(stepping_.progress().state(), stepping->mutable_progress());
  const planner::WarmStart warm = stepping_.planner().warm_start();
  for (const PlainVector4& input : warm.mean) put(input, stepping->mutable_mean_n_s());
  put(warm.asked, stepping->mutable_asked());
  stepping->set_detour_side(warm.detour_side);
  if (const gates::Snapshot* const snapshot = stepping_.gates().snapshot()) {
    stepping->mutable_snapshot()->set_frame(snapshot->frame);
    for (const std::uint32_t waypoint : snapshot->waypoint) stepping->mutable_snapshot()->add_waypoint(waypoint);
  }
  return out.SerializeAsString();
}

Status Pilot::restore(std::string_view bytes, std::chrono::nanoseconds clock_ahead) {
  proto::PilotState in;
  if (!in.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return Error{"the state is damaged: its " + std::to_string(bytes.size()) + " bytes don't read as one",
                 ErrorCode::kInvalid};
  if (in.format() != kStateFormat)
    return Error::invalid("format", std::to_string(in.format()), std::to_string(kStateFormat) + " of this server",
                          ErrorCode::kVersion);
  if (in.model_hash() != model_hash_)
    return Error::invalid("model_hash", std::to_string(in.model_hash()),
                          std::to_string(model_hash_) + ", the model in use: latents fit no other decoder",
                          ErrorCode::kVersion);
  Reader reader;
  if (in.vehicle() != request_.vehicle) reader.fail("vehicle", in.vehicle(), request_.vehicle);
  if (in.session() != session_) reader.fail("session", std::to_string(in.session()), std::to_string(session_));
  if (in.profile() != request_.profile) reader.fail("profile", in.profile(), request_.profile);
  if (in.timing() != static_cast<std::uint32_t>(request_.timing))
    reader.fail("timing", std::to_string(in.timing()), std::to_string(static_cast<int>(request_.timing)));

  std::vector<StateHistory::Entry> history;
  reader.get(in.intake(), &history);
  MotionLine::State motion;
  reader.get(in.intake().motion(), clock_ahead, &motion);

  perception::Sight& sight = looking_.sight();
  const gates::Passages& passages = sight.records().passages();
  std::vector<gates::GateRecords::Record> records = gates::GateRecords(request_.course).records();  // none is seen
  if (in.looking().gates_size() != static_cast<int>(records.size()))
    reader.fail("looking.gates", std::to_string(in.looking().gates_size()), std::to_string(records.size()));
  reader.check_waypoint(in.looking().target(), passages.waypoints(), "looking.target");
  reader.check_waypoint(in.looking().next(), passages.waypoints(), "looking.next");
  for (std::uint32_t waypoint = passages.waypoints(); reader.ok() && waypoint-- > 0;) {
    const std::uint32_t gate = passages.gate(waypoint);
    if (records[gate].gate.seen) continue;  // of another waypoint that passes it
    reader.get(in.looking().gates(static_cast<int>(gate)), passages.nominal(waypoint).shape, &sight.sensor(),
               &records[gate]);
  }

  Stepping::State state = stepping_.state();
  reader.get(in.stepping(), clock_ahead, &state);
  gates::CourseProgress::State progress;
  reader.get(in.stepping().progress(), &progress);
  planner::WarmStart warm;
  warm.mean.resize(static_cast<std::size_t>(stepping_.planner().profile().steps));
  std::vector<double> mean_n_s(warm.mean.size() * kRotors);
  reader.get(in.stepping().mean_n_s(), mean_n_s.size(), mean_n_s.data(), "stepping.mean_n_s");
  for (std::size_t k = 0; k < warm.mean.size(); ++k)
    warm.mean[k] = Eigen::Map<const Eigen::Vector4d>(mean_n_s.data() + k * kRotors);
  reader.get(in.stepping().asked(), &warm.asked, "stepping.asked");
  warm.detour_side = in.stepping().detour_side();
  const proto::Snapshot& snapshot = in.stepping().snapshot();
  if (in.stepping().has_snapshot()) {
    if (snapshot.waypoint_size() != 2)
      reader.fail("stepping.snapshot.waypoint", std::to_string(snapshot.waypoint_size()), "2");
    for (const std::uint32_t waypoint : snapshot.waypoint())
      reader.check_waypoint(waypoint, passages.waypoints(), "stepping.snapshot.waypoint");
  }
  if (!reader.ok()) return reader.status();
  gates::CourseProgress moved = stepping_.progress();
  if (!moved.restore(progress))
    return Error::invalid("stepping.progress",
                          std::to_string(progress.target) + " in lap " + std::to_string(progress.lap),
                          "a waypoint and lap of the course");
  if (!stepping_.planner().restore(warm))
    return Error::invalid("stepping.detour_side", std::to_string(warm.detour_side), "1 or -1");

  const proto::Intake& intake = in.intake();
  Intake::State lines;
  reader.get(intake.states(), clock_ahead, &lines.states);
  reader.get(intake.frames(), clock_ahead, &lines.frames);
  lines.motion.restore(motion);
  intake_.restore(lines);
  const std::uint64_t processed = intake.frames().newest().sequence();
  shared_.last_heard.store((Stamp{intake.last_heard()} + clock_ahead).count());
  shared_.newest_state_rejected.store(intake.newest_state_rejected());
  shared_.repeat_wanted.store(intake.repeat_wanted());
  shared_.frame_named.store(intake.frame_named());
  shared_.frame_refused.store(intake.frame_refused());
  shared_.frame_arrived.store(processed);
  shared_.frame_processed.store(processed);
  shared_.frames_line.store(lines.frames.number);
  shared_.history.restore(history, lines.states.number);
  shared_.good_frame_stamp.store(in.looking().good_frame_stamp());
  shared_.good_frame_line.store(in.looking().good_frame_line());
  shared_.aim({in.looking().target(), in.looking().next()});
  sight.records().restore(std::move(records));
  looking_.restore(processed > 0 ? Stamp{intake.frames().newest().stamp()} : Stamp{-1}, in.looking().line(),
                   lines.frames.number);
  if (in.stepping().has_snapshot()) looking_.publish({snapshot.waypoint(0), snapshot.waypoint(1)}, snapshot.frame());
  stepping_.progress() = moved;
  stepping_.restore(state);
  return {};
}

}  // namespace gatefield::pilot

#include "client/simulator/run_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/base/whole_file.h"

namespace gatefield::simulator {
namespace {

template <typename... Values>
void add(std::string* out, fmt::format_string<const Values&...> format, const Values&... values) {
  fmt::format_to(std::back_inserter(*out), format, values...);
}

double percent_of(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

}  // namespace

std::string in_words(const Actuation& actuation, const config::Mismatch& mismatch) {
  const bool rates = actuation.kind == Actuation::Kind::kBodyRates;
  std::string out = rates ? "body rates" : "rotor thrusts";
  if (rates && mismatch.rate_lag_factor != 1.0) add(&out, "; rate loop x {:.3g}", mismatch.rate_lag_factor);
  if (const Eigen::Vector3d& limit = mismatch.rate_limit_rad_s; rates && !limit.isZero(0.0))
    add(&out, "; rates at most {:.3g}, {:.3g}, {:.3g} rad/s", limit.x(), limit.y(), limit.z());
  if (rates && mismatch.setpoint_delay > Stamp{0})
    add(&out, "; setpoints {:.0f} ms late", 1e3 * seconds(mismatch.setpoint_delay));
  if (mismatch.thrust_factor != 1.0) add(&out, "; thrust x {:.3g}", mismatch.thrust_factor);
  return out;
}

std::string in_words(const HeardProblem& heard) {
  return fmt::format("at {:.2f} s: {}", heard.race_time_s, protocol::sentence(heard.problem));
}

std::string in_words(const HeardSession& heard) {
  return fmt::format("at {:.2f} s: {}", heard.race_time_s, heard.change.sentence);
}

std::string summarize(const Report& report) {
  std::string out;
  const bool real_time = report.timing == protocol::Timing::kRealTime;
  add(&out, "Result        {}\n", report.sentence);
  for (const HeardProblem& problem : report.problems) add(&out, "Problem       {}\n", in_words(problem));
  for (const HeardSession& session : report.sessions) add(&out, "Session       {}\n", in_words(session));
  add(&out, "Seeds         world {}, planner {}\n", report.seed, report.planner_seed);
  add(&out, "Driven by     {}\n", in_words(report.actuation, report.mismatch));
  if (!report.world.empty()) add(&out, "World         {}\n", report.world);
  if (const std::string found = in_words(report.identified, report.actuation); !found.empty())
    add(&out, "Found         {}\n", found);
  if (!report.firmware.empty()) add(&out, "Firmware      {}\n", report.firmware);
  add(&out, "Gates         {} of {} passed{}\n", report.passes.size(), report.gates_total,
      report.missed_gates > 0 ? fmt::format(", {} missed, {} flown again", report.missed_gates, report.retries) : "");
  add(&out, "Lap times    ");
  for (const double lap_s : report.lap_times_s) add(&out, " {:.2f} s", lap_s);
  add(&out, "{}\n", report.lap_times_s.empty() ? " no lap finished" : "");
  add(&out, "Speed         top {:.2f} m/s, mean {:.2f} m/s\n", report.top_speed_m_s, report.mean_speed_m_s);
  if (std::isfinite(report.clearance_m))
    add(&out, "Clearance     {:.2f} m from hull ({}) to frame at the closest\n", std::max(report.clearance_m, 0.0),
        report.hull == config::HullKind::kDiscs ? "rotor discs and body" : "sphere");
  add(&out, "Contacts      {}\n", report.contacts);
  add(&out, "Solve time    p50 {:.2f} ms, p99 {:.2f} ms\n", 1e3 * report.link.solve_p50_s,
      1e3 * report.link.solve_p99_s);
  add(&out, "Round trip    p50 {:.2f} ms, p99 {:.2f} ms (state sent to plan received)\n",
      1e3 * report.link.round_trip_p50_s, 1e3 * report.link.round_trip_p99_s);
  add(&out, "Control ticks {} at {:.0f} Hz, {} late ({:.2f} %); {:.2f} s without a valid plan\n", report.control_ticks,
      report.control_period_s > 0 ? 1.0 / report.control_period_s : 0.0, report.late_ticks,
      percent_of(report.late_ticks, report.control_ticks), report.fallback_s);
  add(&out, "Depth frames  {} sent, {} skipped\n", report.frames_sent, report.frames_skipped);
  if (real_time) {
    add(&out, "Deadlines     {} of {} steps of 1 ms begun late ({:.2f} %), worst {:.1f} ms\n", report.loop_misses,
        report.loop_steps, percent_of(report.loop_misses, report.loop_steps), 1e3 * report.loop_worst_s);
  } else {
    add(&out, "Lockstep      {:.1f} s simulated in {:.1f} s\n", report.race_time_s, report.wall_s);
  }
  if (report.link.packets_dropped > 0)
    add(&out, "Network       {} packets dropped that no DDS participant sends\n", report.link.packets_dropped);
  if (report.link_out_at_s) add(&out, "Link out      from {:.2f} s on\n", *report.link_out_at_s);
  if (report.link.take_overs > 0)
    add(&out, "Taken over    {} times, {:.0f} ms without a command at the longest\n", report.link.take_overs,
        1e3 * report.link.longest_silence_s);
  if (report.link.reconnects > 0)
    add(&out, "Reconnected   {} times, {:.0f} ms without a command at the longest\n", report.link.reconnects,
        1e3 * report.link.longest_silence_s);
  return out;
}

Status write_csv(const std::filesystem::path& file, const Report& report) {
  std::string out =
      "t_s,px_m,py_m,pz_m,vx_m_s,vy_m_s,vz_m_s,qw,qx,qy,qz,wx_rad_s,wy_rad_s,wz_rad_s,"
      "thrust0_n,thrust1_n,thrust2_n,thrust3_n,command0_n,command1_n,command2_n,command3_n,"
      "rate0_n_s,rate1_n_s,rate2_n_s,rate3_n_s,collective_n,wx_asked_rad_s,wy_asked_rad_s,wz_asked_rad_s,source,gate,"
      "lap,target,field_m,latent_age_s,solve_s,effective_samples,"
      "degraded\n";
  out.reserve(out.size() + 320 * report.samples.size());
  for (const Sample& sample : report.samples) {
    const QuadrotorState& s = sample.state;
    add(&out, "{:.3f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},", sample.t_s, s.p_WB.x(), s.p_WB.y(), s.p_WB.z(),
        s.v_WB.x(), s.v_WB.y(), s.v_WB.z());
    add(&out, "{:.6f},{:.6f},{:.6f},{:.6f},{:.5f},{:.5f},{:.5f},", s.q_WB.w(), s.q_WB.x(), s.q_WB.y(), s.q_WB.z(),
        s.w_WB_B.x(), s.w_WB_B.y(), s.w_WB_B.z());
    for (const PlainVector4& values : {s.thrust_n, s.thrust_command_n, sample.setpoint.thrust_rate_n_s})
      add(&out, "{:.4f},{:.4f},{:.4f},{:.4f},", values[0], values[1], values[2], values[3]);
    const Eigen::Vector3d& asked_rad_s = sample.setpoint.body_rates_rad_s;
    add(&out, "{:.4f},{:.5f},{:.5f},{:.5f},", sample.setpoint.collective_thrust_n, asked_rad_s.x(), asked_rad_s.y(),
        asked_rad_s.z());
    const auto& health = sample.health;
    add(&out, "{},{},{},{},{:.4f},{:.4f},{:.6f},{:.1f},{}\n",
        sample.setpoint.source == sdk::Setpoint::Source::kPlan ? "plan" : "fallback", sample.expected_waypoint,
        sample.lap, health.target_waypoint, health.lowest_field_m, health.latent_age_s, health.solve_time_s,
        health.effective_samples, health.degraded ? 1 : 0);
  }
  return write_file(file, out);
}

}  // namespace gatefield::simulator

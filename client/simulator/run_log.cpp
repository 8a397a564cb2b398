#include "client/simulator/run_log.h"

#include <cstdarg>
#include <cstdio>
#include <fstream>
#include <system_error>

namespace gatefield::simulator {
namespace {

[[gnu::format(printf, 2, 3)]] void add(std::string* out, const char* format, ...) {
  char line[512];
  va_list arguments;
  va_start(arguments, format);
  const int length = std::vsnprintf(line, sizeof line, format, arguments);
  va_end(arguments);
  if (length > 0) out->append(line, std::min(static_cast<std::size_t>(length), sizeof line - 1));
}

}  // namespace

std::string summarize(const Report& report) {
  std::string out;
  const bool real_time = report.timing == protocol::Timing::kRealTime;
  add(&out, "Result        %s\n", report.sentence.c_str());
  for (const std::string& problem : report.problems) out += "Problem       " + problem + "\n";
  add(&out, "Seeds         world %llu, planner %llu\n", static_cast<unsigned long long>(report.seed),
      static_cast<unsigned long long>(report.planner_seed));
  add(&out, "Gates         %zu of %d passed\n", report.passes.size(), report.gates_total);
  add(&out, "Lap times    ");
  for (const double lap_s : report.lap_times_s) add(&out, " %.2f s", lap_s);
  add(&out, "%s\n", report.lap_times_s.empty() ? " no lap finished" : "");
  add(&out, "Speed         top %.2f m/s, mean %.2f m/s\n", report.top_speed_m_s, report.mean_speed_m_s);
  if (std::isfinite(report.clearance_m))
    add(&out, "Clearance     %.2f m from hull to frame at the closest\n", std::max(report.clearance_m, 0.0));
  add(&out, "Contacts      %d\n", report.contacts);
  add(&out, "Solve time    p50 %.2f ms, p99 %.2f ms\n", 1e3 * report.link.solve_p50_s, 1e3 * report.link.solve_p99_s);
  add(&out, "Round trip    p50 %.2f ms, p99 %.2f ms (state sent to plan received)\n",
      1e3 * report.link.round_trip_p50_s, 1e3 * report.link.round_trip_p99_s);
  const double late = report.control_ticks > 0
                          ? 100.0 * static_cast<double>(report.late_ticks) / static_cast<double>(report.control_ticks)
                          : 0.0;
  add(&out, "Control ticks %llu at %.0f Hz, %llu late (%.2f %%); %.2f s without a valid plan\n",
      static_cast<unsigned long long>(report.control_ticks),
      report.control_period_s > 0 ? 1.0 / report.control_period_s : 0.0,
      static_cast<unsigned long long>(report.late_ticks), late, report.fallback_s);
  add(&out, "Depth frames  %llu sent, %llu skipped\n", static_cast<unsigned long long>(report.frames_sent),
      static_cast<unsigned long long>(report.frames_skipped));
  if (real_time) {
    const double missed = report.loop_steps > 0
                              ? 100.0 * static_cast<double>(report.loop_misses) / static_cast<double>(report.loop_steps)
                              : 0.0;
    add(&out, "Deadlines     %llu of %llu steps of 1 ms begun late (%.2f %%), worst %.1f ms\n",
        static_cast<unsigned long long>(report.loop_misses), static_cast<unsigned long long>(report.loop_steps), missed,
        1e3 * report.loop_worst_s);
  } else {
    add(&out, "Lockstep      %.1f s simulated in %.1f s\n", report.race_time_s, report.wall_s);
  }
  if (report.link.reconnects > 0)
    add(&out, "Reconnected   %llu times\n", static_cast<unsigned long long>(report.link.reconnects));
  return out;
}

Status write_whole(const std::filesystem::path& file, const void* data, std::size_t size) {
  std::error_code failure;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), failure);
  std::filesystem::path part = file;
  part += ".part";
  {
    std::ofstream out(part, std::ios::binary);
    out.write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
    out.flush();
    if (!out) {
      std::filesystem::remove(part, failure);
      return Error{file.string() +
                   ": can't be written, expected a folder that this user may write to, with room on the disk"};
    }
  }
  std::filesystem::rename(part, file, failure);
  if (failure) return Error{file.string() + ": can't be put in place (" + failure.message() + ")"};
  return {};
}

Status write_csv(const std::filesystem::path& file, const Report& report) {
  std::string out =
      "t_s,px_m,py_m,pz_m,vx_m_s,vy_m_s,vz_m_s,qw,qx,qy,qz,wx_rad_s,wy_rad_s,wz_rad_s,"
      "thrust0_n,thrust1_n,thrust2_n,thrust3_n,command0_n,command1_n,command2_n,command3_n,"
      "rate0_n_s,rate1_n_s,rate2_n_s,rate3_n_s,source,gate,lap,target,field_m,latent_age_s,solve_s,effective_samples,"
      "degraded\n";
  out.reserve(out.size() + 320 * report.samples.size());
  for (const Sample& sample : report.samples) {
    const QuadrotorState& s = sample.state;
    add(&out, "%.3f,%.5f,%.5f,%.5f,%.5f,%.5f,%.5f,", sample.t_s, s.p_WB.x(), s.p_WB.y(), s.p_WB.z(), s.v_WB.x(),
        s.v_WB.y(), s.v_WB.z());
    add(&out, "%.6f,%.6f,%.6f,%.6f,%.5f,%.5f,%.5f,", s.q_WB.w(), s.q_WB.x(), s.q_WB.y(), s.q_WB.z(), s.w_WB_B.x(),
        s.w_WB_B.y(), s.w_WB_B.z());
    for (const Eigen::Vector4d& values : {s.thrust_n, s.thrust_command_n, sample.setpoint.thrust_rate_n_s})
      add(&out, "%.4f,%.4f,%.4f,%.4f,", values[0], values[1], values[2], values[3]);
    const auto& health = sample.health;
    add(&out, "%s,%d,%d,%u,%.4f,%.4f,%.6f,%.1f,%d\n",
        sample.setpoint.source == sdk::Setpoint::Source::kPlan ? "plan" : "fallback", sample.expected_waypoint,
        sample.lap, health.target_waypoint, health.lowest_field_m, health.latent_age_s, health.solve_time_s,
        health.effective_samples, health.degraded ? 1 : 0);
  }
  return write_whole(file, out.data(), out.size());
}

}  // namespace gatefield::simulator

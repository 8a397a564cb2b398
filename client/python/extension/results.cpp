#include "client/python/extension/results.h"

#include <pybind11/numpy.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "client/python/extension/fields.h"
#include "client/python/extension/refusal.h"
#include "common/base/error_name.h"
#include "common/base/text.h"
#include "gatefield/sdk/client.h"
#include "gatefield/sdk/servers.h"

namespace gatefield::python {

namespace py = pybind11;

namespace {

/// A copy.
template <typename Vector>
py::array_t<double> array(const Vector& vector) {
  return py::array_t<double>(static_cast<py::ssize_t>(vector.size()), vector.data());
}

/// The first `rows` of what `plan` holds, without a copy, read-only; it keeps the plan alive.
template <typename Rows>
py::array view(const py::object& plan, const Rows& rows, int count, int columns) {
  std::vector<py::ssize_t> shape{count};
  if (columns > 0) shape.push_back(columns);
  py::array made(py::dtype::of<double>(), shape, rows.data(), plan);
  made.attr("flags").attr("writeable") = false;
  return made;
}
static_assert(sizeof(protocol::ThrustRateCommand{}.rotor_thrust_n) == sizeof(double) * 4 * protocol::kMaxPlanSteps);
static_assert(sizeof(protocol::ThrustRateCommand{}.body_rates_rad_s) == sizeof(double) * 3 * protocol::kMaxPlanSteps);

std::int64_t ns(Stamp stamp) { return stamp.count(); }

const char* name(sdk::SessionChange::Kind kind) {
  switch (kind) {
    case sdk::SessionChange::Kind::kLost:
      return "lost";
    case sdk::SessionChange::Kind::kRejoined:
      return "rejoined";
    case sdk::SessionChange::Kind::kTakenOver:
      return "taken_over";
  }
  return "lost";
}

py::list problems(protocol::Problems set) {
  py::list all;
  for (const protocol::Problem problem : protocol::list(set)) all.append(problem);
  return all;
}

/// Read-only attributes, and a repr() that shows them all.
template <typename Class, typename... More>
class Record {
 public:
  Record(py::module_* module, const char* name, const char* doc) : class_(*module, name, doc), name_(name) {}

  template <typename Get>
  Record& with(const char* name, Get get) {
    class_.def_property_readonly(name, std::move(get));
    names_.emplace_back(name);
    return *this;
  }
  template <typename Value, typename Owner>
  Record& with(const char* name, Value Owner::*member) {
    return with(name, [member](const Class& self) { return self.*member; });
  }
  template <typename Owner>
  Record& with(const char* name, std::string Owner::*member) {
    return with(name, [member](const Class& self) { return text(self.*member); });
  }
  py::class_<Class, More...>& done() {
    class_.def("__repr__", [name = name_, names = names_](const py::object& self) {
      std::string shown = name + "(";
      for (std::size_t i = 0; i < names.size(); ++i)
        shown += (i ? ", " : "") + names[i] + "=" + std::string(py::repr(self.attr(names[i].c_str())));
      return shown + ")";
    });
    return class_;
  }

 private:
  py::class_<Class, More...> class_;
  const std::string name_;
  std::vector<std::string> names_;
};

void bind_problem(py::module_* module) {
  py::enum_<protocol::Problem> made(*module, "Problem",
                                    "What can be wrong with a flight, as the server sees it; .sentence says it.");
  for (int i = 0; i < protocol::kProblems; ++i) {
    const auto problem = static_cast<protocol::Problem>(i);
    made.value(std::string(protocol::name(problem)).c_str(), problem);
  }
  made.def_property_readonly("sentence",
                             [](protocol::Problem problem) { return std::string(protocol::sentence(problem)); });
}

void bind_setpoint(py::module_* module) {
  using sdk::Setpoint;
  Record<Setpoint> setpoint(module, "Setpoint", "What to ask the vehicle for, as play() gives it.");
  setpoint.with("source", [](const Setpoint& s) { return s.source == Setpoint::Source::kPlan ? "plan" : "fallback"; })
      .with("rotor_thrust_n", [](const Setpoint& s) { return array(s.rotor_thrust_n); })
      .with("thrust_rate_n_s", [](const Setpoint& s) { return array(s.thrust_rate_n_s); })
      .with("collective_thrust_n", &Setpoint::collective_thrust_n)
      .with("body_rates_rad_s", [](const Setpoint& s) { return array(s.body_rates_rad_s); });
  setpoint.done().def(py::init([](const py::object& collective_thrust_n, const py::object& body_rates_rad_s) {
                        Setpoint made;
                        made.collective_thrust_n = to_number(collective_thrust_n, "collective_thrust_n");
                        const auto rates = to_array(body_rates_rad_s, "body_rates_rad_s", {3});
                        made.body_rates_rad_s = Eigen::Map<const Eigen::Vector3d>(rates.data());
                        return made;
                      }),
                      py::kw_only(), py::arg("collective_thrust_n"), py::arg("body_rates_rad_s"),
                      "What somebody else asks the vehicle for: of applied().");
}

void bind_plan(py::module_* module) {
  using protocol::PlannerHealth;
  Record<PlannerHealth> health(module, "PlannerHealth", "How the planner is doing.");
  health.with("solve_time_s", &PlannerHealth::solve_time_s)
      .with("effective_samples", &PlannerHealth::effective_samples)
      .with("lowest_field_m", &PlannerHealth::lowest_field_m)
      .with("latent_age_s", &PlannerHealth::latent_age_s)
      .with("state_age_s", &PlannerHealth::state_age_s)
      .with("target_waypoint", &PlannerHealth::target_waypoint)
      .with("lap", &PlannerHealth::lap)
      .with("course_done", &PlannerHealth::course_done)
      .with("degraded", &PlannerHealth::degraded)
      .with("problems", [](const PlannerHealth& h) { return problems(h.problems); });
  health.done();

  using Command = protocol::ThrustRateCommand;
  const auto command = [](const py::object& self) -> const Command& { return self.cast<const Command&>(); };
  Record<Command, std::shared_ptr<Command>> plan(module, "Plan", "A plan, as the server sent it.");
  plan.with("sequence", &Command::sequence)
      .with("answers_sequence", &Command::answers_sequence)
      .with("answers_stamp", [](const Command& c) { return ns(c.answers_stamp); })
      .with("start", [](const Command& c) { return ns(c.plan_start); })
      .with("step", [](const Command& c) { return ns(c.plan_step); })
      .with("validity", [](const Command& c) { return ns(c.validity); })
      .with("steps", &Command::steps)
      .with(
          "actuation",
          [](const Command& c) { return c.actuation == Actuation::Kind::kBodyRates ? "body_rates" : "rotor_thrusts"; })
      .with("isa",
            [](const Command& c) { return text(std::string(c.isa.data(), strnlen(c.isa.data(), c.isa.size()))); })
      .with("health", &Command::health);
  plan.done()
      .def_property_readonly("stamps",
                             [](const Command& c) {
                               py::array_t<std::int64_t> stamps(c.steps);
                               for (int k = 0; k < c.steps; ++k)
                                 stamps.mutable_at(k) = ns(c.plan_start + k * c.plan_step);
                               return stamps;
                             })
      .def_property_readonly("rotor_thrust_n",
                             [command](const py::object& self) {
                               return view(self, command(self).rotor_thrust_n, command(self).steps, 4);
                             })
      .def_property_readonly("thrust_rate_n_s",
                             [command](const py::object& self) {
                               return view(self, command(self).thrust_rate_n_s, command(self).steps, 4);
                             })
      .def_property_readonly("body_rates_rad_s",
                             [command](const py::object& self) {
                               return view(self, command(self).body_rates_rad_s, command(self).steps, 3);
                             })
      .def_property_readonly("collective_thrust_n", [command](const py::object& self) {
        return view(self, command(self).collective_thrust_n, command(self).steps, 0);
      });
}

void bind_news(py::module_* module) {
  using sdk::ProblemChange;
  Record<ProblemChange>(module, "ProblemChange", "Something that the server found wrong, or no longer.")
      .with("problem", &ProblemChange::problem)
      .with("began", &ProblemChange::began)
      .done();
  using sdk::SessionChange;
  Record<SessionChange>(module, "SessionChange", "What became of the session without this program's doing.")
      .with("kind", [](const SessionChange& c) { return name(c.kind); })
      .with("why", [](const SessionChange& c) { return std::string(gatefield::name(c.why)); })
      .with("server", &SessionChange::server)
      .with("sentence", &SessionChange::sentence)
      .done();
  using sdk::LinkStatistics;
  Record<LinkStatistics>(module, "Statistics", "Of the link, since connect().")
      .with("commands", &LinkStatistics::commands)
      .with("rejected", &LinkStatistics::rejected)
      .with("reconnects", &LinkStatistics::reconnects)
      .with("take_overs", &LinkStatistics::take_overs)
      .with("packets_dropped", &LinkStatistics::packets_dropped)
      .with("round_trip_p50_s", &LinkStatistics::round_trip_p50_s)
      .with("round_trip_p99_s", &LinkStatistics::round_trip_p99_s)
      .with("longest_silence_s", &LinkStatistics::longest_silence_s)
      .with("solve_p50_s", &LinkStatistics::solve_p50_s)
      .with("solve_p99_s", &LinkStatistics::solve_p99_s)
      .done();
}

void bind_telemetry(py::module_* module) {
  using protocol::IdentifiedDrive;
  Record<IdentifiedDrive>(module, "IdentifiedDrive", "How a vehicle of body rates follows what it is asked for.")
      .with("thrust_factor", &IdentifiedDrive::thrust_factor)
      .with("rate_time_constant_s", [](const IdentifiedDrive& d) { return array(d.rate_time_constant_s); })
      .with("rate_limit_rad_s", [](const IdentifiedDrive& d) { return array(d.rate_limit_rad_s); })
      .done();
  using protocol::Telemetry;
  Record<Telemetry>(module, "Telemetry", "What a server says of a flight, a few times a second.")
      .with("server_stamp", [](const Telemetry& t) { return ns(t.server_stamp); })
      .with("health", &Telemetry::health)
      .with("states_received", &Telemetry::states_received)
      .with("states_rejected", &Telemetry::states_rejected)
      .with("frames_received", &Telemetry::frames_received)
      .with("frames_rejected", &Telemetry::frames_rejected)
      .with("frames_invalid", &Telemetry::frames_invalid)
      .with("commands_sent", &Telemetry::commands_sent)
      .with("deadlines_missed", &Telemetry::deadlines_missed)
      .with("encode_time_s", &Telemetry::encode_time_s)
      .with("identified", &Telemetry::identified)
      .with("last_code", [](const Telemetry& t) { return std::string(gatefield::name(t.last_code)); })
      .with("last_field", &Telemetry::last_field)
      .with("last_value", &Telemetry::last_value)
      .with("last_expected", &Telemetry::last_expected)
      .with("last_reason", &Telemetry::last_reason)
      .with("isa", &Telemetry::isa)
      .done();
}

void bind_servers(py::module_* module) {
  using protocol::SessionReply;
  Record<SessionReply>(module, "Session", "The session that a server accepted.")
      .with("server", &SessionReply::server)
      .with("number", &SessionReply::session)
      .with("control_period_s", &SessionReply::control_period_s)
      .with("plan_step_s", &SessionReply::plan_step_s)
      .with("plan_steps", &SessionReply::plan_steps)
      .with("model_hash", [](const SessionReply& r) { return hex(r.model_hash); })
      .done();
  using protocol::ServerStatus;
  Record<ServerStatus>(module, "Server", "A server of a domain, as it says itself.")
      .with("name", &ServerStatus::name)
      .with("accepts", &ServerStatus::accepts)
      .with("sessions", &ServerStatus::sessions)
      .with("room_cores", &ServerStatus::room_cores)
      .with("isa", &ServerStatus::isa)
      .with("model_hash", [](const ServerStatus& s) { return hex(s.model_hash); })
      .with("wire_version", &ServerStatus::version)
      .done();
}

}  // namespace

void bind_results(py::module_* module) {
  bind_problem(module);
  bind_setpoint(module);
  bind_plan(module);
  bind_news(module);
  bind_telemetry(module);
  bind_servers(module);
}

}  // namespace gatefield::python

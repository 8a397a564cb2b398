"""What the service says no to, as exceptions.

Every exception is a `Refused` and carries what the server or the SDK said: `code` to decide by, `field`, `value` and
`expected` where a field was wrong, and `sentence`, which says it all (and is `str(exception)`).
"""


class Refused(Exception):
    """Something that a file, a peer or a caller made impossible.

    code: its kind: "invalid", "unknown_name", "unreadable", "version", "unsupported", "busy_name", "busy_server",
        "no_answer", "leaving", "abandoned", "wrong_session", "not_rising", "frame", "not_answering" or "other".
    field: dotted path of what was wrong, "quadrotor.mass_kg"; "": no field's fault.
    value: the field's value as text; "": none.
    expected: what would have been right; "": the sentence says it.
    sentence: all of that for people.
    file, line: of a text file, where it went wrong; "" and 0: in none.
    """

    def __init__(self, sentence, code="other", field="", value="", expected="", file="", line=0):
        super().__init__(sentence)
        self.sentence = sentence
        self.code = code
        self.field = field
        self.value = value
        self.expected = expected
        self.file = file
        self.line = line

    @property
    def may_pass(self):
        """True for what may be gone a moment later: trying again makes sense."""
        return self.code in ("busy_name", "busy_server", "no_answer")

    def __reduce__(self):  # so that it comes out of a process pool as it went in
        return type(self), (self.sentence, self.code, self.field, self.value, self.expected, self.file, self.line)


class Invalid(Refused, ValueError):
    """A field's value is out of its range, of another type or shape, or contradicts another field."""


class UnknownName(Refused, ValueError):
    """A name that is none of those known: of a profile, a model, a file."""


class Unreadable(Refused):
    """A file that is missing, can't be read, or is malformed."""


class WrongVersion(Refused):
    """The server speaks another version of the protocol."""


class Unsupported(Refused):
    """Understood, and not offered by this build, machine, server or process."""


class Busy(Refused):
    """The name is in use ("busy_name") or the server full ("busy_server"); may pass."""


class NoAnswer(Refused):
    """No server answered in time; may pass."""


_KINDS = {
    "invalid": Invalid,
    "unknown_name": UnknownName,
    "unreadable": Unreadable,
    "version": WrongVersion,
    "unsupported": Unsupported,
    "busy_name": Busy,
    "busy_server": Busy,
    "no_answer": NoAnswer,
}


def refusal(code, sentence, field="", value="", expected="", file="", line=0):
    """The exception for a code."""
    return _KINDS.get(code, Refused)(sentence, code, field, value, expected, file, line)

"""What a source does not say, asked of the options, and said all at once when they don't say it either."""

from gatefield.errors import Invalid


class Needs:
    def __init__(self, file, options):
        self.file = file
        self._options = options
        self._missing = []

    def given(self, option):
        """The option's value, or None."""
        return getattr(self._options, option, None)

    def take(self, option, told, what, form, hint=""):
        """The option's value, else `told` (of the file); neither: noted as missing, and None.

        what: how the sentence calls it. form: how the option is written, "--opening M".
        """
        value = self.given(option)
        if value is None:
            value = told
        if value is None:
            self.miss(option, what, form, hint)
        return value

    def miss(self, option, what, form, hint=""):
        """Notes that it is missing."""
        name = "--" + option.replace("_", "-")
        self._missing.append((name, f"it does not say {what}: give {form}{' (' + hint + ')' if hint else ''}"))

    def check(self):
        """Raises Invalid for all that is missing, one line each."""
        if self._missing:
            lines = "\n".join(f"  {sentence}" for _, sentence in self._missing)
            raise Invalid(f"{self.file} does not say all that a Gatefield file has to:\n{lines}", "invalid",
                          self._missing[0][0], file=str(self.file))

"""The paper's recipe run as printed, and with one thing changed at a time; findings in figures."""

"""Speed, measured: what users wait for and what machines do, beside other tools in the same run."""

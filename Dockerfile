# gaitval in a container. The context is a checkout; nothing but its packages is fetched.
#
#   docker build --tag gaitval .                                        all but training (docs/how-to/systems.md: how large)
#   docker build --tag gaitval --build-arg EXTRAS=[study] .             with training
#   docker run --rm --volume "$PWD:/work" gaitval check --quick --baseline S05
FROM python:3.13-slim
ARG EXTRAS=""
# dartpy loads libGL; the PDF needs Pango
RUN apt-get update \
    && apt-get install --yes --no-install-recommends \
        libgl1 libpango-1.0-0 libpangoft2-1.0-0 libpangocairo-1.0-0 \
    && rm -rf /var/lib/apt/lists/*
COPY . /gaitval
RUN python -m pip install --no-cache-dir --constraint /gaitval/constraints.txt "/gaitval${EXTRAS}" \
    && rm -rf /gaitval
# Not as root: what it writes into /work belongs to this user, or to that of `docker run --user`.
# What is compiled once, in a minute, is kept in /compiled/gaitval, which belongs to the user who made it and nobody else can
# write to; gaitval takes none of another user's. /compiled itself is as /tmp is: any user may make that folder, and no other
# may remove it (the sticky bit). A named volume there, of one user, keeps it from run to run; each version has its own part.
#   docker run --rm --volume gaitval-compiled:/compiled --volume "$PWD:/work" gaitval check --quick --baseline S05
RUN useradd --create-home walker \
    && install --directory --owner=walker /work \
    && install --directory --mode=1777 /compiled
USER walker
ENV XDG_CACHE_HOME=/compiled
WORKDIR /work
ENTRYPOINT ["gaitval"]
CMD ["--help"]

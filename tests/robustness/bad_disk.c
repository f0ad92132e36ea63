/* A disk that fails at its n-th operation, for a program that is started with this in LD_PRELOAD.

   Operations below BAD_DISK_FOLDER are counted, over all processes, in the file BAD_DISK_COUNT; the
   one with number BAD_DISK_AT fails with the error number BAD_DISK_ERROR, and with BAD_DISK_LASTS=1
   all after it do. BAD_DISK_KINDS says which are counted: w those that write, r those that read,
   d those that remove as well. What the C library's own `fwrite` writes is not seen. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

static atomic_int *count;
static int at, error_number, lasts;
static const char *folder, *kinds;

__attribute__((constructor)) static void start(void)
{
    const char *file = getenv("BAD_DISK_COUNT");
    folder = getenv("BAD_DISK_FOLDER");
    kinds = getenv("BAD_DISK_KINDS");
    if (!file || !folder || !kinds)
        return;
    at = atoi(getenv("BAD_DISK_AT"));
    error_number = atoi(getenv("BAD_DISK_ERROR"));
    lasts = atoi(getenv("BAD_DISK_LASTS"));
    int (*real)(const char *, int, ...) = dlsym(RTLD_NEXT, "open64");
    int handle = real(file, O_RDWR);
    void *shared = mmap(NULL, sizeof *count, PROT_READ | PROT_WRITE, MAP_SHARED, handle, 0);
    if (shared != MAP_FAILED)
        count = shared;
    close(handle);
}

static int below(const char *path)
{
    size_t n = strlen(folder);
    return !strncmp(path, folder, n) && (path[n] == '/' || !path[n]);
}

static int open_below(int handle)
{
    char name[64], path[4096];
    struct stat about;
    if (!count || fstat(handle, &about) || !S_ISREG(about.st_mode))
        return 0;
    snprintf(name, sizeof name, "/proc/self/fd/%d", handle);
    ssize_t n = readlink(name, path, sizeof path - 1);
    if (n <= 0)
        return 0;
    path[n] = 0;
    return below(path);
}

static int path_below(int of, const char *path)
{
    char whole[8192], name[64];
    if (!count || !path)
        return 0;
    if (path[0] == '/')
        return below(path);
    if (of == AT_FDCWD) {
        if (!getcwd(whole, 4096))
            return 0;
    } else {
        snprintf(name, sizeof name, "/proc/self/fd/%d", of);
        ssize_t n = readlink(name, whole, 4096);
        if (n <= 0)
            return 0;
        whole[n] = 0;
    }
    strncat(whole, "/", 2);
    strncat(whole, path, 4000);
    return below(whole);
}

static int fails(char kind)
{
    if (!strchr(kinds, kind))
        return 0;
    int number = atomic_fetch_add(count, 1) + 1;
    if (!at || (lasts ? number < at : number != at))
        return 0;
    errno = error_number;
    return 1;
}

#define REAL(type, name, ...)                        \
    static type (*real)(__VA_ARGS__);                \
    if (!real)                                       \
        real = dlsym(RTLD_NEXT, name);

#define ON_HANDLE(type, name, kind, declared, passed, ...) \
    type name declared                                     \
    {                                                      \
        REAL(type, #name, __VA_ARGS__)                     \
        if (open_below(fd) && fails(kind))                 \
            return -1;                                     \
        return real passed;                                \
    }

#define ON_PATH(name, kind, of, declared, passed, ...) \
    int name declared                                  \
    {                                                  \
        REAL(int, #name, __VA_ARGS__)                  \
        if (path_below(of, path) && fails(kind))       \
            return -1;                                 \
        return real passed;                            \
    }

ON_HANDLE(ssize_t, write, 'w', (int fd, const void *b, size_t n), (fd, b, n), int, const void *, size_t)
ON_HANDLE(ssize_t, pwrite, 'w', (int fd, const void *b, size_t n, off_t o), (fd, b, n, o), int, const void *, size_t, off_t)
ON_HANDLE(ssize_t, pwrite64, 'w', (int fd, const void *b, size_t n, off_t o), (fd, b, n, o), int, const void *, size_t, off_t)
ON_HANDLE(ssize_t, writev, 'w', (int fd, const struct iovec *v, int n), (fd, v, n), int, const struct iovec *, int)
ON_HANDLE(ssize_t, sendfile, 'w', (int fd, int in, off_t *o, size_t n), (fd, in, o, n), int, int, off_t *, size_t)
ON_HANDLE(ssize_t, sendfile64, 'w', (int fd, int in, off_t *o, size_t n), (fd, in, o, n), int, int, off_t *, size_t)
ON_HANDLE(int, fsync, 'w', (int fd), (fd), int)
ON_HANDLE(int, fdatasync, 'w', (int fd), (fd), int)
ON_HANDLE(int, ftruncate, 'w', (int fd, off_t n), (fd, n), int, off_t)
ON_HANDLE(int, ftruncate64, 'w', (int fd, off_t n), (fd, n), int, off_t)
ON_HANDLE(int, fchmod, 'd', (int fd, mode_t m), (fd, m), int, mode_t)
ON_HANDLE(ssize_t, read, 'r', (int fd, void *b, size_t n), (fd, b, n), int, void *, size_t)
ON_HANDLE(ssize_t, pread, 'r', (int fd, void *b, size_t n, off_t o), (fd, b, n, o), int, void *, size_t, off_t)
ON_HANDLE(ssize_t, pread64, 'r', (int fd, void *b, size_t n, off_t o), (fd, b, n, o), int, void *, size_t, off_t)

ON_PATH(mkdir, 'w', AT_FDCWD, (const char *path, mode_t m), (path, m), const char *, mode_t)
ON_PATH(mkdirat, 'w', of, (int of, const char *path, mode_t m), (of, path, m), int, const char *, mode_t)
ON_PATH(rename, 'w', AT_FDCWD, (const char *path, const char *to), (path, to), const char *, const char *)
ON_PATH(renameat, 'w', of, (int of, const char *path, int h, const char *to), (of, path, h, to), int, const char *, int, const char *)
ON_PATH(chmod, 'd', AT_FDCWD, (const char *path, mode_t m), (path, m), const char *, mode_t)
ON_PATH(unlink, 'd', AT_FDCWD, (const char *path), (path), const char *)
ON_PATH(rmdir, 'd', AT_FDCWD, (const char *path), (path), const char *)
ON_PATH(unlinkat, 'd', of, (int of, const char *path, int f), (of, path, f), int, const char *, int)

/* Errors of a network share come when a file that was written is closed. */
int close(int fd)
{
    REAL(int, "close", int)
    int written = open_below(fd) && (fcntl(fd, F_GETFL) & O_ACCMODE) != O_RDONLY && fails('w');
    int done = real(fd);
    if (!written)
        return done;
    errno = error_number;
    return -1;
}

#define OPENS(name, opened, of, declared, passed, ...)                                  \
    int name declared                                                                   \
    {                                                                                   \
        REAL(int, #name, __VA_ARGS__)                                                   \
        mode_t mode = 0;                                                                \
        if (flags & (O_CREAT | O_TMPFILE)) {                                            \
            va_list more;                                                               \
            va_start(more, flags);                                                      \
            mode = va_arg(more, mode_t);                                                \
            va_end(more);                                                               \
        }                                                                               \
        if (path_below(of, path)                                                        \
            && fails((flags & O_ACCMODE) != O_RDONLY || flags & O_CREAT ? 'w' : 'r'))   \
            return -1;                                                                  \
        return real passed;                                                             \
    }

OPENS(open, "open", AT_FDCWD, (const char *path, int flags, ...), (path, flags, mode), const char *, int, ...)
OPENS(open64, "open64", AT_FDCWD, (const char *path, int flags, ...), (path, flags, mode), const char *, int, ...)
OPENS(openat, "openat", of, (int of, const char *path, int flags, ...), (of, path, flags, mode), int, const char *, int, ...)
OPENS(openat64, "openat64", of, (int of, const char *path, int flags, ...), (of, path, flags, mode), int, const char *, int, ...)

static FILE *opened(FILE *(*real)(const char *, const char *), const char *path, const char *mode)
{
    if (path_below(AT_FDCWD, path) && fails(strpbrk(mode, "wa+") ? 'w' : 'r'))
        return NULL;
    return real(path, mode);
}

FILE *fopen(const char *path, const char *mode)
{
    REAL(FILE *, "fopen", const char *, const char *)
    return opened(real, path, mode);
}

FILE *fopen64(const char *path, const char *mode)
{
    REAL(FILE *, "fopen64", const char *, const char *)
    return opened(real, path, mode);
}

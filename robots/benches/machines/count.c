/* Instructions that an emulated machine runs for each of some functions: a plugin of QEMU, interface 1 (QEMU 6 to 8), declared here as far as
 * it is used. Arguments: root=NAME, part of a function's symbol. What runs after a root has begun counts for it, calls included, until
 * a symbol with `harness` in its name runs. At the end it prints a line per root: instructions, name. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

__attribute__((visibility("default"))) int qemu_plugin_version = 1;
typedef uint64_t qemu_plugin_id_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t, void (*)(qemu_plugin_id_t, struct qemu_plugin_tb *));
void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb *, void (*)(unsigned, void *), int, void *);
void qemu_plugin_register_atexit_cb(qemu_plugin_id_t, void (*)(qemu_plugin_id_t, void *), void *);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *, size_t);
const char *qemu_plugin_insn_symbol(const struct qemu_plugin_insn *);

enum { MOST = 256 };
static const char *roots[MOST];
static uint64_t counts[MOST];
static int known, running = -1;

/* a stretch of instructions without a jump: of a root, of the harness (-2), or of what either calls (-1) */
struct stretch { int of; uint64_t instructions; };

static void run(unsigned cpu, void *data)
{
    const struct stretch *s = data;
    (void)cpu;
    if (s->of != -1)
        running = s->of;
    if (running >= 0)
        counts[running] += s->instructions;
}

static void translated(qemu_plugin_id_t id, struct qemu_plugin_tb *tb)
{
    const char *symbol = qemu_plugin_insn_symbol(qemu_plugin_tb_get_insn(tb, 0));
    struct stretch *s = malloc(sizeof *s);
    (void)id;
    s->of = symbol == NULL || strstr(symbol, "harness") != NULL ? -2 : -1;
    /* the longest: one function's name may begin another's */
    for (int k = 0; s->of != -2 && k < known; k++)
        if (strstr(symbol, roots[k]) != NULL && (s->of == -1 || strlen(roots[k]) > strlen(roots[s->of])))
            s->of = k;
    s->instructions = qemu_plugin_tb_n_insns(tb);
    qemu_plugin_register_vcpu_tb_exec_cb(tb, run, 0, s);
}

static void finish(qemu_plugin_id_t id, void *data)
{
    (void)id;
    (void)data;
    for (int k = 0; k < known; k++)
        fprintf(stderr, "%llu %s\n", (unsigned long long)counts[k], roots[k]);
}

__attribute__((visibility("default"))) int qemu_plugin_install(qemu_plugin_id_t id, const void *info, int argc, char **argv)
{
    (void)info;
    for (int k = 0; k < argc && known < MOST; k++)
        if (strncmp(argv[k], "root=", 5) == 0)
            roots[known++] = strdup(argv[k] + 5);
    qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
    qemu_plugin_register_atexit_cb(id, finish, NULL);
    return 0;
}
